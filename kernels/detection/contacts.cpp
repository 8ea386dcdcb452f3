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
  for (auto* values : {&contacts.mx, &contacts.my, &contacts.mz, &contacts.arm})
    values->resize(candidates.impulse.kind() == ImpulseKind::rolling ? n : 0);
  contacts.rn.resize(friction ? 0 : n);
  if (friction) contacts.rn.shrink_to_fit();
  for (auto* values : {&contacts.first, &contacts.second}) values->resize(n);
  contacts.candidate.resize(n);
  std::iota(contacts.candidate.begin(), contacts.candidate.end(), 0);
  for (std::size_t k = 0; k < candidates.grain_pairs.size(); ++k) {
    contacts.first[k] = candidates.grain_pairs[k].first;
    contacts.second[k] = candidates.grain_pairs[k].second;
  }
  const bool blocks = std::ranges::find(chunks.kind, ChunkKind::blocks) != chunks.kind.end();
  contacts.levers.resize(blocks ? n : 0);
  contacts.balls.resize(contacts.levers.size());
  contacts.group.resize(n);
  contacts.count.assign(chunks.size(), 0);
  contacts.passed.assign(chunks.size(), 0);
}

void store_impulses(const Contacts& contacts, const Chunks& chunks, std::size_t chunk,
                    Candidates& candidates) {
  const auto begin = static_cast<std::size_t>(chunks.begin[chunk]),
             room = static_cast<std::size_t>(chunks.begin[chunk + 1]);
  const auto end = begin + static_cast<std::size_t>(contacts.count[chunk]);
  std::ranges::fill(candidates.impulse.values(begin, room), 0.0);
  const ImpulseKind kind = candidates.impulse.kind();
  for (std::size_t a = begin; a < end; ++a) {
    const auto k = static_cast<std::size_t>(contacts.candidate[a]);
    const std::span<double> to = candidates.impulse.row(k);
    if (kind == ImpulseKind::normal) {
      to[0] = contacts.rn[a];
      continue;
    }
    to[0] = contacts.rx[a];
    to[1] = contacts.ry[a];
    to[2] = contacts.rz[a];
    if (kind == ImpulseKind::force) continue;
    to[3] = contacts.mx[a];
    to[4] = contacts.my[a];
    to[5] = contacts.mz[a];
  }
}

void restore_impulses(const Candidates& candidates, const Chunks& chunks, std::size_t chunk,
                      Contacts& contacts) {
  const auto begin = static_cast<std::size_t>(chunks.begin[chunk]);
  const auto end = begin + static_cast<std::size_t>(contacts.count[chunk]);
  const ImpulseKind kind = candidates.impulse.kind();
  for (std::size_t a = begin; a < end; ++a) {
    const auto k = static_cast<std::size_t>(contacts.candidate[a]);
    const std::span<const double> from = candidates.impulse.row(k);
    if (kind == ImpulseKind::normal) {
      contacts.rn[a] = from[0];
      continue;
    }
    contacts.rx[a] = from[0];
    contacts.ry[a] = from[1];
    contacts.rz[a] = from[2];
    if (kind == ImpulseKind::force) continue;
    contacts.mx[a] = from[3];
    contacts.my[a] = from[4];
    contacts.mz[a] = from[5];
  }
}

void turn_moments(const Chunks& chunks, std::size_t chunk, Contacts& contacts) {
  if (contacts.mx.empty()) return;
  const auto begin = static_cast<std::size_t>(chunks.begin[chunk]);
  const auto end = begin + static_cast<std::size_t>(contacts.count[chunk]);
  for (std::size_t a = begin; a < end; ++a) {
    const Vec3 n(contacts.nx[a], contacts.ny[a], contacts.nz[a]),
        kept(contacts.mx[a], contacts.my[a], contacts.mz[a]), m = kept - kept.dot(n) * n;
    contacts.mx[a] = m[0];
    contacts.my[a] = m[1];
    contacts.mz[a] = m[2];
  }
}

void convert_impulses(Candidates& candidates, ImpulseKind kind, std::span<const Vec3> x,
                      std::span<const Wall> walls, const Domain& domain) {
  if (kind == candidates.impulse.kind()) return;
  const std::size_t grains = candidates.grain_pairs.size();
  KeptImpulses converted(kind);
  converted.assign_zeros(candidates.size());
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
    const Vec3 impulse = candidates.impulse.force(k, normal);
    const std::span<double> to = converted.row(k);
    if (kind == ImpulseKind::normal)
      to[0] = std::max(0.0, impulse.dot(normal));
    else
      std::copy_n(impulse.data(), 3, to.begin());  // moments begin at 0
  }
  candidates.impulse = std::move(converted);
}

std::size_t memory_used(const Contacts& contacts) {
  std::size_t bytes = 0;
  for (const auto* values :
       {&contacts.nx, &contacts.ny, &contacts.nz, &contacts.bias, &contacts.rx, &contacts.ry, &contacts.rz,
        &contacts.rn, &contacts.mu, &contacts.cohesion, &contacts.mx, &contacts.my, &contacts.mz,
        &contacts.arm, &contacts.vx, &contacts.vy, &contacts.vz, &contacts.reach})
    bytes += values->capacity() * sizeof(double);
  return bytes +
         (contacts.first.capacity() + contacts.second.capacity() + contacts.candidate.capacity() +
          contacts.count.capacity() + contacts.passed.capacity()) *
             4 +
         contacts.group.capacity() + contacts.levers.capacity() * sizeof(Levers) +
         contacts.spin.capacity() * sizeof(Vec3) + contacts.balls.capacity() * 2;
}

}  // namespace talus
