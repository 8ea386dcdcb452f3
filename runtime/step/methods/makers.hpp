#pragma once

/// The methods that the registry lists, and what they share.

#include "runtime/step/methods/method.hpp"

namespace talus {

std::unique_ptr<Method> make_automatic(const MethodContext& context);
std::unique_ptr<Method> make_nlgs(const MethodContext& context);
std::unique_ptr<Method> make_momentum(const MethodContext& context);
std::unique_ptr<Method> make_nncg(const MethodContext& context);
std::unique_ptr<Method> make_adaptive(const MethodContext& context);
std::unique_ptr<Method> make_admm(const MethodContext& context);

/// The next plan after a check of sweeps with momentum; none if the error has fallen. If it has grown,
/// momentum restarts with 1 - beta doubled, which also stops its oscillation. Sweeps become plain if the
/// error has grown too much, or beta would be 0.
std::optional<SweepPlan> restarted_momentum(const MomentumParameters& parameters, double most, double growth);
/// Plain sweeps where conjugate gradients have failed.
std::optional<SweepPlan> ended_conjugate(const ConjugateParameters& parameters, double growth);

}  // namespace talus
