#include "runtime/step/methods/makers.hpp"

namespace talus {

std::optional<SweepPlan> ended_conjugate(const ConjugateParameters& parameters, double growth) {
  if (!(growth > parameters.hopeless_growth)) return std::nullopt;
  return SweepPlan{};
}

namespace {

class Nncg : public Method {
 public:
  SweepPlan begin() const override { return {SweepKind::conjugate, 0}; }
  std::optional<SweepPlan> after_check(const SweepPlan& now, double growth) const override {
    if (now.kind != SweepKind::conjugate) return std::nullopt;
    return ended_conjugate(parameters_, growth);
  }

 private:
  ConjugateParameters parameters_;
};

}  // namespace

std::unique_ptr<Method> make_nncg(const MethodContext&) {
  return std::make_unique<Nncg>();
}

}  // namespace talus
