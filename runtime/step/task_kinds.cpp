#include "runtime/step/task_kinds.hpp"

namespace talus {

std::vector<trace::KindInfo> task_kinds() {
  using trace::Phase;
  std::vector<trace::KindInfo> kinds = trace::runtime_kinds();
  // name, phase, blocked, shared, collectives
  const trace::KindInfo own[] = {{"predict", Phase::update, false, false, 0},
                                 {"cells", Phase::detection, false, true, 1},
                                 {"pairs", Phase::detection, false, false, 0},
                                 {"chunks", Phase::detection, false, true, 0},
                                 {"narrow", Phase::detection, false, false, 0},
                                 {"plan", Phase::detection, false, true, 1},
                                 {"finish", Phase::update, false, false, 0},
                                 {"walls", Phase::update, false, false, 1},
                                 {"report", Phase::update, false, false, 0},
                                 {"sum", Phase::update, false, true, 1},
                                 {"partition", Phase::partitioning, false, true, 12},
                                 {"accumulate", Phase::sweeps, false, false, 0},
                                 {"measure", Phase::sweeps, false, false, 0},
                                 {"sweep", Phase::sweeps, false, false, 0},
                                 {"restore", Phase::sweeps, false, false, 0},
                                 {"publish", Phase::exchange, false, false, 0},
                                 {"centre", Phase::exchange, false, false, 0},
                                 {"glue", Phase::sweeps, false, false, 0},
                                 {"whole", Phase::sweeps, false, true, 0},
                                 {"leavers", Phase::detection, false, true, 3}};
  kinds.insert(kinds.end(), std::begin(own), std::end(own));
  return kinds;
}

}  // namespace talus
