#include "kernels/clusters/loaded_groups.hpp"

#include <algorithm>
#include <cstdint>

#include "kernels/bodies/index.hpp"
#include "kernels/clusters/disjoint_sets.hpp"
#include "kernels/global/natural_map.hpp"

namespace talus {

std::vector<char> carrying(const BodyProblem& cluster) {
  std::vector<char> joins;
  for (const Vec3& r : cluster.impulse) joins.push_back(cluster.has_cell() || r != Vec3::Zero() ? 1 : 0);
  return joins;
}

std::vector<LoadedGroup> loaded_groups(const BodyProblem& cluster, std::span<const char> joins) {
  DisjointSets sets(cluster.bodies.size());
  for (std::size_t k = 0; k < joins.size(); ++k) {
    const ContactEquation& c = cluster.contacts[k];
    if (joins[k] == 0) continue;
    if (c.second >= 0) sets.join(c.first, c.second);
    if (c.cell >= 0) sets.join(c.first, c.cell);
  }
  std::vector<LoadedGroup> groups;
  std::vector<std::size_t> group(cluster.bodies.size());
  std::vector<std::int32_t> unknown(cluster.bodies.size());
  for (std::size_t b = 0; b < group.size(); ++b) {
    const std::size_t lowest = at(sets.find(static_cast<std::int32_t>(b)));
    if (lowest == b) {
      group[b] = groups.size();
      groups.emplace_back();
    }
    group[b] = group[lowest];
    LoadedGroup& own = groups[group[b]];
    unknown[b] = static_cast<std::int32_t>(own.bodies.size());
    own.bodies.push_back(b);
    own.problem.bodies.push_back(cluster.bodies[b]);
    if (b < cluster.grains) ++own.problem.grains;
  }
  for (std::size_t k = 0; k < cluster.contacts.size(); ++k) {
    ContactEquation c = cluster.contacts[k];
    const std::size_t own = group[at(c.first)];
    if (c.second >= 0 && group[at(c.second)] != own) continue;
    c.first = unknown[at(c.first)];
    if (c.second >= 0) c.second = unknown[at(c.second)];
    if (c.cell >= 0) c.cell = unknown[at(c.cell)];
    groups[own].problem.contacts.push_back(c);
    groups[own].problem.impulse.push_back(cluster.impulse[k]);
    if (!cluster.rolling.empty()) groups[own].problem.rolling.push_back(cluster.rolling[k]);
    groups[own].contacts.push_back(k);
  }
  return groups;
}

double closing(const BodyProblem& cluster, const ContactEquation& contact, std::span<const Twist> V) {
  return natural_map_of(cluster, contact, Vec3::Zero(), constrained_velocity(contact, V)).carried.norm();
}

}  // namespace talus
