#include "apps/commands/run_ranks.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <set>
#include <span>
#include <sstream>
#include <vector>

#include "apps/shared/print.hpp"

namespace talus {

void share_start(Setup& setup, const graph::Communicator& ranks) {
  std::vector<double*> values;
  for (Wall& wall : setup.walls) {
    for (Vec3* vector : {&wall.point, &wall.velocity})
      for (double& number : *vector) values.push_back(&number);
    values.push_back(&wall.load.mass);
  }
  for (Stage& stage : setup.stages)
    for (auto& [name, load] : stage.loads) values.push_back(&load.mass);
  for (double& stress : setup.stress_at_start) values.push_back(&stress);
  std::vector<double> own;
  if (ranks.rank() == 0)
    for (const double* value : values) own.push_back(*value);
  const std::vector<double> shared = ranks.gather_records(std::span<const double>(own));
  for (std::size_t k = 0; k < values.size(); ++k) *values[k] = shared[k];
  std::vector<BodyId> ids;
  if (ranks.rank() == 0)
    for (const NamedBody& body : setup.named) ids.push_back(body.id);
  ids = ranks.gather_records(std::span<const BodyId>(ids));
  for (std::size_t k = 0; k < ids.size(); ++k) setup.named[k].id = ids[k];
}

bool any_refused(const std::string& why, const graph::Communicator& ranks) {
  const std::string own = why.empty() ? "" : fmt::format("{} {}", ranks.rank(), why) + '\0';
  const std::vector<char> all = ranks.gather_records(std::span<const char>(own));
  std::istringstream refusals(ranks.rank() == 0 ? std::string(all.begin(), all.end()) : "");
  std::set<std::string> said;
  for (std::string refusal; std::getline(refusals, refusal, '\0');) {
    const std::size_t space = refusal.find(' ');
    const std::string rank = refusal.substr(0, space), sentence = refusal.substr(space + 1);
    if (!said.insert(sentence).second) continue;
    print_error("talus: error: {}{}\n", rank == "0" ? "" : "rank " + rank + ": ", sentence);
    if (rank == "0") break;
  }
  return !all.empty();
}

void end_all(int code, const graph::Communicator& ranks, const std::function<void()>& alone) {
  constexpr double for_a_word = 1, for_files = 5;  // [s]
  std::fflush(nullptr);
  const bool met = ranks.meet(ranks.rank() == 0 ? for_a_word : for_files);
  if (!met && ranks.rank() != 0 && alone) {
    try {
      alone();
    } catch (const std::exception&) {
      // The reason is on stderr already; a folder that this rank cannot reach keeps what it says.
    }
  }
  ranks.abort(code);
}

}  // namespace talus
