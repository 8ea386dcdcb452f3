#include "runtime/step/methods/makers.hpp"

namespace talus {

namespace {

class Nlgs : public Method {
 public:
  SweepPlan begin() const override { return {}; }
};

}  // namespace

std::unique_ptr<Method> make_nlgs(const MethodContext&) {
  return std::make_unique<Nlgs>();
}

}  // namespace talus
