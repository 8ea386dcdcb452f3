#include "kernels/detection/contacts.hpp"

#include <algorithm>
#include <numeric>

#include "kernels/detection/wall_pairs.hpp"

namespace talus {

namespace {

/// d over its length; +z for coincident centres.
Vec3 unit_normal(const Vec3& d, double length) {
  return length > 0 ? Vec3(d / length) : Vec3::UnitZ();
}

}  // namespace

void allocate(Contacts& contacts, const Candidates& candidates, const Chunks& chunks, bool friction) {
  const std::size_t n = candidates.size();
  for (auto* values : {&contacts.nx, &contacts.ny, &contacts.nz, &contacts.bias}) values->resize(n);
  for (auto* values : {&contacts.rx, &contacts.ry, &contacts.rz}) {
    values->resize(friction ? n : 0);
    if (!friction) values->shrink_to_fit();
  }
  const bool mixed = std::ranges::find(chunks.law, mixed_laws) != chunks.law.end();
  contacts.mu.resize(friction && mixed ? n : 0);
  contacts.rn.resize(friction ? 0 : n);
  if (friction) contacts.rn.shrink_to_fit();
  for (auto* values : {&contacts.first, &contacts.second}) values->resize(n);
  for (auto* values : {&contacts.first_record, &contacts.second_record}) values->resize(n);
  contacts.candidate.resize(n);
  std::iota(contacts.candidate.begin(), contacts.candidate.end(), 0);
  for (std::size_t k = 0; k < candidates.grain_pairs.size(); ++k) {
    contacts.first[k] = candidates.grain_pairs[k].first;
    contacts.second[k] = candidates.grain_pairs[k].second;
    contacts.first_record[k] = record_of(contacts.first[k]);
    contacts.second_record[k] = record_of(contacts.second[k]);
  }
  contacts.group.resize(n);
  contacts.count.assign(chunks.size(), 0);
  contacts.passed.assign(chunks.size(), 0);
}

void store_impulses(const Contacts& contacts, const Chunks& chunks, std::size_t chunk,
                    Candidates& candidates) {
  const auto begin = static_cast<std::size_t>(chunks.begin[chunk]),
             room = static_cast<std::size_t>(chunks.begin[chunk + 1]);
  const auto end = begin + static_cast<std::size_t>(contacts.count[chunk]);
  const auto components = static_cast<std::size_t>(candidates.components);
  std::fill(candidates.impulse.begin() + static_cast<std::ptrdiff_t>(components * begin),
            candidates.impulse.begin() + static_cast<std::ptrdiff_t>(components * room), 0.0);
  for (std::size_t a = begin; a < end; ++a) {
    const auto k = static_cast<std::size_t>(contacts.candidate[a]);
    if (components == 3) {
      candidates.impulse[3 * k] = contacts.rx[a];
      candidates.impulse[3 * k + 1] = contacts.ry[a];
      candidates.impulse[3 * k + 2] = contacts.rz[a];
    } else {
      candidates.impulse[k] = contacts.rn[a];
    }
  }
}

void restore_impulses(const Candidates& candidates, const Chunks& chunks, std::size_t chunk,
                      Contacts& contacts) {
  const auto begin = static_cast<std::size_t>(chunks.begin[chunk]);
  const auto end = begin + static_cast<std::size_t>(contacts.count[chunk]);
  for (std::size_t a = begin; a < end; ++a) {
    const auto k = static_cast<std::size_t>(contacts.candidate[a]);
    if (candidates.components == 3) {
      contacts.rx[a] = candidates.impulse[3 * k];
      contacts.ry[a] = candidates.impulse[3 * k + 1];
      contacts.rz[a] = candidates.impulse[3 * k + 2];
    } else {
      contacts.rn[a] = candidates.impulse[k];
    }
  }
}

void convert_impulses(Candidates& candidates, int components, std::span<const Vec3> x,
                      std::span<const Wall> walls, const Domain& domain) {
  if (components == candidates.components) return;
  const std::size_t grains = candidates.grain_pairs.size();
  std::vector<double> converted(candidates.size() * static_cast<std::size_t>(components));
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    Vec3 normal;
    if (k < grains) {
      const GrainPair& pair = candidates.grain_pairs[k];
      const Vec3 d = domain.separation(x[static_cast<std::size_t>(pair.first)],
                                       x[static_cast<std::size_t>(pair.second)]);
      normal = unit_normal(d, d.norm());
    } else {
      const WallPair& pair = candidates.wall_pairs[k - grains];
      normal = wall_point(walls[static_cast<std::size_t>(pair.wall)], x[static_cast<std::size_t>(pair.body)],
                          pair.feature, domain)
                   .normal;
    }
    if (components == 3)
      for (std::size_t c = 0; c < 3; ++c)
        converted[3 * k + c] = candidates.impulse[k] * normal[static_cast<Eigen::Index>(c)];
    else
      converted[k] = std::max(0.0, Eigen::Map<const Vec3>(&candidates.impulse[3 * k]).dot(normal));
  }
  candidates.impulse = std::move(converted);
  candidates.components = components;
}

std::size_t memory_used(const Contacts& contacts) {
  std::size_t bytes = 0;
  for (const auto* values : {&contacts.nx, &contacts.ny, &contacts.nz, &contacts.bias, &contacts.rx,
                             &contacts.ry, &contacts.rz, &contacts.rn, &contacts.mu, &contacts.cohesion})
    bytes += values->capacity() * sizeof(double);
  return bytes +
         (contacts.first.capacity() + contacts.second.capacity() + contacts.first_record.capacity() +
          contacts.second_record.capacity() + contacts.candidate.capacity() + contacts.count.capacity() +
          contacts.passed.capacity()) *
             4 +
         contacts.group.capacity();
}

}  // namespace talus
