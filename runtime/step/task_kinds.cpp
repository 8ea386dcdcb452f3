#include "runtime/step/task_kinds.hpp"

namespace talus {

std::vector<trace::KindInfo> task_kinds() {
  using trace::Phase;
  std::vector<trace::KindInfo> kinds = trace::runtime_kinds();
  // name, phase, blocked, shared
  const trace::KindInfo own[] = {
      {"predict", Phase::update, false, false},        {"cells", Phase::detection, false, true},
      {"pairs", Phase::detection, false, false},       {"chunks", Phase::detection, false, true},
      {"narrow", Phase::detection, false, false},      {"plan", Phase::detection, false, true},
      {"finish", Phase::update, false, false},         {"walls", Phase::update, false, false},
      {"report", Phase::update, false, false},         {"sum", Phase::update, false, true},
      {"partition", Phase::partitioning, false, true}, {"accumulate", Phase::sweeps, false, false},
      {"measure", Phase::sweeps, false, false},        {"sweep", Phase::sweeps, false, false},
      {"restore", Phase::sweeps, false, false},        {"publish", Phase::exchange, false, false},
      {"root", Phase::exchange, false, false},         {"glue", Phase::sweeps, false, false},
      {"take", Phase::sweeps, false, false},           {"tell", Phase::exchange, false, false},
      {"whole", Phase::sweeps, false, false},          {"sums", Phase::sweeps, false, true},
      {"position", Phase::sweeps, false, false}};
  kinds.insert(kinds.end(), std::begin(own), std::end(own));
  return kinds;
}

}  // namespace talus
