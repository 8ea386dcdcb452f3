#pragma once

/// The methods that the registry lists, and what they share.

#include "runtime/step/methods/method.hpp"

namespace talus {

std::unique_ptr<Method> make_automatic(const MethodContext& context);
std::unique_ptr<Method> make_nlgs(const MethodContext& context);
std::unique_ptr<Method> make_momentum(const MethodContext& context);
std::unique_ptr<Method> make_nncg(const MethodContext& context);
std::unique_ptr<Method> make_admm(const MethodContext& context);

/// Momentum that has made the error worse begins anew with 1 - beta doubled, which also ends what it swings
/// by; with growth beyond hope, or nothing left of beta, sweeps become plain. None: it has made the error
/// smaller.
std::optional<SweepPlan> restarted_momentum(const MomentumParameters& parameters, double most, double growth);
/// Plain sweeps where conjugate gradients have failed.
std::optional<SweepPlan> ended_conjugate(const ConjugateParameters& parameters, double growth);

}  // namespace talus
