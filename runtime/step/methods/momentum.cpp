#include "runtime/step/methods/makers.hpp"

namespace talus {

std::optional<SweepPlan> restarted_momentum(const MomentumParameters& parameters, double most,
                                            double growth) {
  if (!(growth > 1)) return std::nullopt;
  const double less = 1 - 2 * (1 - most);
  if (less > 0 && growth < parameters.hopeless_growth) return SweepPlan{SweepKind::momentum, less};
  return SweepPlan{};
}

namespace {

class Momentum : public Method {
 public:
  explicit Momentum(const MethodContext& context)
      : most_(most_momentum(parameters_, context.friction, context.settings.tolerance)) {}

  SweepPlan begin() const override { return {SweepKind::momentum, most_}; }
  std::optional<SweepPlan> after_check(const SweepPlan& now, double growth) const override {
    if (now.kind != SweepKind::momentum) return std::nullopt;
    return restarted_momentum(parameters_, now.most, growth);
  }

 private:
  MomentumParameters parameters_;
  double most_;
};

}  // namespace

std::unique_ptr<Method> make_momentum(const MethodContext& context) {
  return std::make_unique<Momentum>(context);
}

}  // namespace talus
