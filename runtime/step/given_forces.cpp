#include "runtime/step/given_forces.hpp"

#include <algorithm>
#include <array>
#include <numeric>

namespace talus {

namespace {

constexpr std::size_t forces_at_once = 8192;

/// A row of KeptImpulses; moments begin at 0.
std::array<double, 6> row_of(const GivenForce& given, ImpulseKind kind, double impulse_time) {
  std::array<double, 6> row{};
  for (std::size_t k = 0; k < 3; ++k) {
    if (kind == ImpulseKind::normal)
      row[0] += impulse_time * given.force[k] * given.normal[k];
    else
      row[k] = impulse_time * given.force[k];
  }
  if (kind == ImpulseKind::normal) row[0] = std::max(0.0, row[0]);
  return row;
}

}  // namespace

Candidates given_candidates(std::span<const GivenForce> own, const graph::Communicator& ranks,
                            ImpulseKind kind, double impulse_time, std::size_t bodies,
                            const std::function<Slot(std::int64_t)>& slot_of) {
  Candidates old;
  old.impulse = KeptImpulses(kind);
  KeptImpulses at_walls(kind);
  const auto add = [&](const GivenForce& given) {
    const Slot first = slot_of(given.first);
    const Slot second = given.second < 0 ? 0 : slot_of(given.second);
    if (first < 0 || second < 0) return;
    const std::array<double, 6> row = row_of(given, kind, impulse_time);
    if (given.second < 0) {
      old.wall_pairs.push_back(
          {static_cast<std::int32_t>(-1 - given.second), first, static_cast<std::int32_t>(given.feature)});
      at_walls.push_back(row);
    } else {
      old.grain_pairs.push_back({first, second});
      old.impulse.push_back(row);
    }
  };
  std::int64_t all[1] = {static_cast<std::int64_t>(own.size())};
  ranks.sum(all);
  for (std::size_t begin = 0; begin < static_cast<std::size_t>(all[0]); begin += forces_at_once) {
    const std::size_t from = std::min(begin, own.size()), to = std::min(begin + forces_at_once, own.size());
    for (const GivenForce& given : ranks.gather_records(own.subspan(from, to - from))) add(given);
  }
  old.impulse.append(at_walls);
  std::vector<Slot> same(bodies);
  std::iota(same.begin(), same.end(), 0);
  renumber(old, same);
  return old;
}

}  // namespace talus
