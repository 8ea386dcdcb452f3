#include "runtime/step/methods/makers.hpp"

namespace talus {

namespace {

constexpr Entry<SolverMethod, MethodMaker> entries[] = {
    {SolverMethod::automatic, "auto", "momentum, and admm where sweeps leave forces out of balance",
     make_automatic},
    {SolverMethod::nlgs, "nlgs", "sweeps as they are", make_nlgs},
    {SolverMethod::momentum, "nlgs+momentum", "each sweep begins beyond where the last one ended",
     make_momentum},
    {SolverMethod::nncg, "nncg", "nonsmooth conjugate gradients", make_nncg},
    {SolverMethod::admm, "admm", "for long chains and heavy bodies, then sweeps", make_admm},
};

}  // namespace

const Registry<SolverMethod, MethodMaker>& methods() {
  static constexpr Registry<SolverMethod, MethodMaker> registry("method", entries);
  return registry;
}

}  // namespace talus
