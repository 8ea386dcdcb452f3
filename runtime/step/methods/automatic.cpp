#include "runtime/step/methods/makers.hpp"

namespace talus {

namespace {

/// Parameters besides those of the methods whose plans it uses.
struct AutomaticParameters {
  /// If the largest beta falls below this, in (0, 1), conjugate gradients are faster than momentum.
  double least_momentum = 0.85;
  /// A problem that needs fewer plain sweeps is not stiff, > 0: sweeps alone solve it, and ADMM is not called
  /// before as many were done.
  double stiff = 1000;
  AdmmCalls calls;
};

/// Sweeps with momentum, as long as they reduce the error; conjugate gradients where beta has become too
/// small; plain sweeps where both fail. ADMM is called when sweeps leave the forces out of balance in a
/// problem that ADMM solves faster than they do.
class Automatic : public Method {
 public:
  explicit Automatic(const MethodContext& context)
      : plain_(context.plain),
        most_(most_momentum(momentum_, context.friction, context.settings.tolerance)) {}

  SweepPlan begin() const override { return plain_ ? SweepPlan{} : SweepPlan{SweepKind::momentum, most_}; }

  std::optional<SweepPlan> after_check(const SweepPlan& now, double growth) const override {
    switch (now.kind) {
      case SweepKind::plain:
        break;
      case SweepKind::conjugate:
        return ended_conjugate(conjugate_, growth);
      case SweepKind::momentum: {
        const std::optional<SweepPlan> next = restarted_momentum(momentum_, now.most, growth);
        const bool slow = next && next->most < parameters_.least_momentum;
        return slow && growth < momentum_.hopeless_growth ? SweepPlan{SweepKind::conjugate, 0} : next;
      }
    }
    // Momentum that ADMM has interrupted is taken up again.
    if (now.most > 0) return SweepPlan{SweepKind::momentum, now.most};
    return std::nullopt;
  }

  /// Momentum can go in circles about what plain sweeps reach.
  std::optional<SweepPlan> after_stagnation(const SweepPlan& now) const override {
    if (now.kind == SweepKind::plain) return std::nullopt;
    return SweepPlan{};
  }

  /// Plain sweeps first: ADMM leaves errors at light bodies, and momentum would throw these at the heavy ones
  /// that ADMM has settled.
  SweepPlan after_admm(const SweepPlan& now) const override {
    return {now.kind == SweepKind::momentum ? SweepKind::plain : now.kind, now.most};
  }

  bool corrects() const override { return true; }

  bool calls_admm(MethodView& view) const override {
    return admm_due(parameters_.calls, view) &&
           (view.sweeps_needed() >= parameters_.stiff ||
            (view.sweeps_since_start() >= parameters_.stiff && view.checks_velocities())) &&
           !view.balanced();
  }

 private:
  AutomaticParameters parameters_;
  MomentumParameters momentum_;
  ConjugateParameters conjugate_;
  bool plain_;
  double most_;
};

}  // namespace

std::unique_ptr<Method> make_automatic(const MethodContext& context) {
  return std::make_unique<Automatic>(context);
}

}  // namespace talus
