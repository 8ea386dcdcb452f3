#include "kernels/delassus/delassus_auto.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "kernels/delassus/delassus_admm.hpp"
#include "kernels/delassus/delassus_sweeps.hpp"
#include "kernels/delassus/newton.hpp"

namespace talus {
namespace {

constexpr double never = std::numeric_limits<double>::infinity();

/// One of the methods, once it has begun.
struct Runner {
  std::function<void()> iterate;
  std::function<void()> begin_from_best;  ///< of all methods' answers
  detail::OwnError* own = nullptr;        ///< null: has not begun
};

class Portfolio {
 public:
  Portfolio(const DelassusProblem& problem, const AutoSettings& settings, BestAnswer& answer)
      : problem_(problem), settings_(settings), answer_(answer), sweep_(sweep_cost(problem)) {
    begin(momentum);
  }

  void run() {
    Runner& main = runner_[momentum];
    while (!answer_.over()) {
      const Method next = choose();
      if (!runner_[next].own) begin(next);
      Runner& runner = runner_[next];
      if (answer_.least() < settings_.better * runner.own->least() && stalled(next, next == momentum ? settings_.stall_sweeps : settings_.stall)) {
      if (getenv("TRACE")) fprintf(stderr, "%c anew at %.1e from %.1e, sweeps %.0f\n", "MCNA"[next], runner.own->least(), answer_.least(), runner.own->work() / sweep_);
        runner.begin_from_best();
        runner.own->begin(answer_.least());
      }
      const double until = runner.own->work() + settings_.slice * main.own->work();
      do runner.iterate();
      while (!answer_.over() && runner.own->work() < until);
    }
    if (getenv("TRACE")) {
      fprintf(stderr, "least %g:", answer_.least());
      for (std::size_t k = 0; k < methods; ++k)
        if (runner_[k].own) fprintf(stderr, " %c %.0f sweeps (%.1e)", "MCNA"[k], runner_[k].own->work() / sweep_, runner_[k].own->least());
      fprintf(stderr, "\n");
    }
  }

 private:
  enum Method : std::size_t { momentum, conjugate, newton, admm };
  static constexpr std::size_t methods = 4;

  template <class Solver>
  void adopt(Method method, Solver& solver) {
    runner_[method] = {[&] { solver.iterate(answer_); }, [&] { solver.begin_from(answer_.best()); },
                       &solver.progress()};
    solver.progress().begin(answer_.least());
  }
  void begin(Method method) {
    using Start = SweepsOnTheWay::Start;
    const std::span<const double> r = answer_.best();
    switch (method) {
      case momentum: return adopt(method, momentum_.emplace(problem_, Start::momentum, SweepSettings{}, r));
      case conjugate: return adopt(method, conjugate_.emplace(problem_, Start::conjugate, SweepSettings{}, r));
      case newton: return adopt(method, newton_.emplace(*form_, NewtonSettings{}, r));
      case admm: return adopt(method, admm_.emplace(*form_, AdmmSettings{}, r));
    }
  }
  /// The least error was found before the later part of the work.
  bool stalled(Method method, double part) const {
    const detail::OwnError& own = *runner_[method].own;
    return own.work_since_least() > std::max(part * own.work_since_begin(), 0.75 * first(method));
  }
  /// Work that a method needs before anything may be said of it.
  double first(Method method) const {
    switch (method) {
      case momentum: return 30 * sweep_;
      case conjugate: return std::max(40 * sweep_, runner_[momentum].own->work());
      case newton: return settings_.newton_steps * (form_->factorisation_cost() + 8 * sweep_);
      case admm: return form_->factorisation_cost() + settings_.admm_steps * 3 * sweep_;
    }
    return never;
  }
  double remaining(Method method) const {
    const detail::OwnError* own = runner_[method].own;
    if (!own) return first(method);
    const double spent = own->work_since_begin();
    return std::min(own->remaining(answer_.goal().tolerance),
                    std::max(first(method) - spent, settings_.patience * spent));
  }
  /// Whether those that factorise may be asked.
  bool factorises(double main_left) {
    if (form_ || !factorising_) return factorising_;
    const double analysis = detail::analysis_cost(problem_);
    if (runner_[momentum].own->work() < 2 * analysis || main_left < analysis) return false;
    std::int64_t failed = 0;
    factorising_ = lawful(problem_, failed);
    if (factorising_) {
      form_.emplace(problem_);
      analysis_ = analysis;
    }
    return factorising_;
  }
  double work(Method method) const { return runner_[method].own ? runner_[method].own->work() : 0.0; }

  Method choose() {
    const detail::OwnError& main = *runner_[momentum].own;
    const bool stands = stalled(momentum, settings_.stall);
    const double main_left = settings_.pessimism * remaining(momentum);
    const bool factorising = factorises(main_left);
    Method best = conjugate;
    double left = stands || runner_[conjugate].own ? remaining(conjugate) : never;
    for (const Method method : {newton, admm}) {
      if (!factorising || (method == admm && admm_ && !admm_->regular())) continue;
      if (const double own = remaining(method); own < left) {
        left = own;
        best = method;
      }
    }
    if (left == never) return momentum;
    const double others = analysis_ + work(conjugate) + work(newton) + work(admm);
    const double start = runner_[best].own || best == conjugate ? 0 : form_->factorisation_cost();
    const bool foretold = runner_[best].own && runner_[best].own->remaining(answer_.goal().tolerance) <= left;
    double most = left < main_left ? (foretold ? settings_.most_foretold : settings_.most) : settings_.least;
    if (stands) most = settings_.most_stalled;
    return others + start < most * main.work() ? best : momentum;
  }

  const DelassusProblem& problem_;
  const AutoSettings& settings_;
  BestAnswer& answer_;
  double sweep_, analysis_ = 0;
  bool factorising_ = true;
  std::optional<detail::FactorisedForm> form_;
  std::optional<SweepsOnTheWay> momentum_, conjugate_;
  std::optional<NewtonOnTheWay> newton_;
  std::optional<AdmmOnTheWay> admm_;
  std::array<Runner, methods> runner_;
};

}  // namespace

DelassusReport solve_auto(const DelassusProblem& problem, const DelassusGoal& goal, const AutoSettings& given,
                          std::span<double> r) {
  BestAnswer answer(problem, goal, r);
  if (answer.over()) return answer.hand_back();
  AutoSettings settings = given;
  if (const char* e = getenv("AUTO")) sscanf(e, "%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf", &settings.patience, &settings.most, &settings.most_foretold, &settings.most_stalled, &settings.least, &settings.stall, &settings.stall_sweeps, &settings.newton_steps, &settings.admm_steps,&settings.slice,&settings.pessimism);
  Portfolio(problem, settings, answer).run();
  return answer.hand_back();
}

}  // namespace talus
