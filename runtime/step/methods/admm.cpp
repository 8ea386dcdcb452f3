#include "runtime/step/methods/makers.hpp"

namespace talus {

bool admm_due(const AdmmCalls& calls, const MethodView& view) {
  const int before = view.admm_calls();
  return before < calls.most && view.sweeps_since_start() >= calls.chance << (2 * before);
}

namespace {

class AdmmMethod : public Method {
 public:
  SweepPlan begin() const override { return {}; }
  bool calls_admm(MethodView& view) const override {
    return view.admm_calls() == 0 || (admm_due(calls_, view) && !view.balanced());
  }

 private:
  AdmmCalls calls_;
};

}  // namespace

std::unique_ptr<Method> make_admm(const MethodContext&) {
  return std::make_unique<AdmmMethod>();
}

}  // namespace talus
