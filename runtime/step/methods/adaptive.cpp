#include "runtime/step/methods/makers.hpp"

namespace talus {

namespace {

struct AdaptiveParameters {
  /// beta of the first sweeps, in (0, 1): too small rather than too large, as an error that has grown has to
  /// be made good.
  double first_most = 0.84;
  /// Never more than this, in (0, 1).
  double largest_most = 0.98;
  /// An error that a check finds above this part of the one before falls slowly: 1 - beta is halved. In (0,
  /// 1).
  double slow = 0.3;
};

/// Sweeps with momentum whose beta follows from how the error falls, where the other methods choose it by the
/// tolerance: nothing has to be known of how many sweeps the problem takes. Plain sweeps where it fails.
class Adaptive : public Method {
 public:
  explicit Adaptive(bool plain) : plain_(plain) {}

  SweepPlan begin() const override {
    return plain_ ? SweepPlan{} : SweepPlan{SweepKind::momentum, parameters_.first_most};
  }
  std::optional<SweepPlan> after_check(const SweepPlan& now, double growth) const override {
    if (now.kind != SweepKind::momentum) return std::nullopt;
    if (growth > 1) return restarted_momentum(momentum_, now.most, growth);
    const double more = 1 - (1 - now.most) / 2;
    if (growth < parameters_.slow || more > parameters_.largest_most) return std::nullopt;
    return SweepPlan{SweepKind::momentum, more};
  }

 private:
  bool plain_;
  AdaptiveParameters parameters_;
  MomentumParameters momentum_;
};

}  // namespace

std::unique_ptr<Method> make_adaptive(const MethodContext& context) {
  return std::make_unique<Adaptive>(context.plain);
}

}  // namespace talus
