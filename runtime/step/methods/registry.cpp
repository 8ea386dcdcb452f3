#include "runtime/step/methods/makers.hpp"

namespace talus {

namespace {

constexpr Entry<SolverMethod, MethodMaker> entries[] = {
    named<SolverMethod>("auto", "momentum, and admm where sweeps leave forces out of balance",
                        make_automatic),
    named<SolverMethod>("nlgs", "sweeps as they are", make_nlgs),
    named<SolverMethod>("nlgs+momentum", "each sweep begins beyond where the last one ended", make_momentum),
    named<SolverMethod>("nlgs+adaptive", "momentum as large as the error bears", make_adaptive),
    named<SolverMethod>("nncg", "nonsmooth conjugate gradients", make_nncg),
    named<SolverMethod>("admm", "for long chains and heavy bodies, then sweeps", make_admm),
};

}  // namespace

const Registry<SolverMethod, MethodMaker>& methods() {
  static constexpr Registry<SolverMethod, MethodMaker> registry("method", entries);
  return registry;
}

}  // namespace talus
