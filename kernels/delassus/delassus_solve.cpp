#include "kernels/delassus/delassus_solve.hpp"

#include <utility>

#include "kernels/delassus/delassus_admm.hpp"
#include "kernels/delassus/delassus_auto.hpp"
#include "kernels/delassus/delassus_sweeps.hpp"
#include "kernels/delassus/newton.hpp"

namespace talus {
namespace {

constexpr std::pair<DelassusMethod, std::string_view> names[] = {
    {DelassusMethod::nlgs, "nlgs"},     {DelassusMethod::nlgs_momentum, "nlgs+momentum"},
    {DelassusMethod::nncg, "nncg"},     {DelassusMethod::admm, "admm"},
    {DelassusMethod::newton, "newton"}, {DelassusMethod::automatic, "auto"},
};

}  // namespace

std::string_view name_of(DelassusMethod method) {
  for (const auto& [of, name] : names)
    if (of == method) return name;
  return "";
}

std::optional<DelassusMethod> delassus_method(std::string_view name) {
  for (const auto& [method, of] : names)
    if (of == name) return method;
  return std::nullopt;
}

DelassusReport solve_delassus(const DelassusProblem& problem, DelassusMethod method, const DelassusGoal& goal,
                              std::span<double> r) {
  switch (method) {
    case DelassusMethod::nlgs:
      return solve_nlgs(problem, goal, {.momentum = 0}, r);
    case DelassusMethod::nlgs_momentum:
      return solve_nlgs(problem, goal, {}, r);
    case DelassusMethod::nncg:
      return solve_nncg(problem, goal, SweepSettings{}.damping, r);
    case DelassusMethod::admm:
      return solve_admm(problem, goal, {}, r);
    case DelassusMethod::newton:
      return solve_newton(problem, goal, {}, r);
    case DelassusMethod::automatic:
      break;
  }
  return solve_auto(problem, goal, {}, r);
}

}  // namespace talus
