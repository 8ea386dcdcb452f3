#include "kernels/contacts.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace talus {

namespace {

struct Found {
  Vec3 normal;
  double bias;
  std::int32_t candidate;
};

/// Bias of a contact, or false when it constrains nothing in this step. `v_n` is the normal velocity at the
/// beginning of the step, `v_n_free` the one at its end without contacts.
bool constrain(const NarrowPhase& in, double gap, double v_n, double v_n_free, double slow, double& bias) {
  if (gap >= in.alert && gap >= -in.time_step * v_n_free) return false;
  bias = (gap > 0 ? gap : in.overlap_correction * gap) / in.time_step;
  // Separating contacts too follow the impact law, as in Moreau's: with e here and 0 there, a grain caught
  // between both would gain energy.
  if (in.restitution > 0 && std::abs(v_n) > slow) {
    if (gap > 0) return false;
    bias = in.restitution * v_n;
  }
  return true;
}

/// d over its length; +z for coincident centres.
Vec3 unit_normal(const Vec3& d, double length) {
  return length > 0 ? Vec3(d / length) : Vec3::UnitZ();
}

/// True when two bodies have gone in by more than half of `small`, the smaller radius, while the line from
/// one centre to the other moved on by `way` to `d`; what they overlapped at its beginning does not count.
bool passed(const Vec3& d, const Vec3& way, double touching, double small) {
  if (way.squaredNorm() < 0.25 * small * small) return false;
  const Vec3 start = d - way;
  const double nearest = std::clamp(-start.dot(way) / way.squaredNorm(), 0.0, 1.0);
  const double overlap = touching - (start + nearest * way).norm();
  return overlap - std::max(0.0, touching - start.norm()) > 0.5 * small;
}

/// Appends the contacts of a chunk to `found`, in the order in which they are to be dealt to groups, and
/// returns the pairs that passed.
std::int32_t find_contacts(const NarrowPhase& in, const Candidates& candidates, const Chunks& chunks,
                           std::size_t chunk, std::vector<Found>& found) {
  std::int32_t through = 0;
  const double half_step = 0.5 * in.time_step;
  const std::size_t grains = candidates.grain_pairs.size();
  const auto begin = static_cast<std::size_t>(chunks.begin[chunk]),
             end = static_cast<std::size_t>(chunks.begin[chunk + 1]);
  const double slow = 2 * in.time_step * in.gravity.norm();
  const auto u = [&](std::size_t s) { return Eigen::Map<const Vec3>(in.velocity[s].u); };
  if (chunks.wall[chunk] < 0) {
    for (std::size_t at = begin; at < end; ++at) {
      const std::size_t k = begin + chunks.order[at];
      const auto i = static_cast<std::size_t>(candidates.grain_pairs[k].first);
      const auto j = static_cast<std::size_t>(candidates.grain_pairs[k].second);
      const Vec3 d = in.x[i] - in.x[j];
      const double distance = d.norm();
      const Vec3 normal = unit_normal(d, distance);
      double bias;
      const Vec3 v = u(i) - u(j);
      const double v_n = normal.dot(v);  // gravity moves both alike
      through += passed(in.x[i] - in.x[j], half_step * v, in.radius[i] + in.radius[j],
                        std::min(in.radius[i], in.radius[j]));
      if (constrain(in, distance - in.radius[i] - in.radius[j], v_n, v_n, slow, bias))
        found.push_back({normal, bias, static_cast<std::int32_t>(k)});
    }
    return through;
  }
  const Wall& wall = in.walls[static_cast<std::size_t>(chunks.wall[chunk])];
  const double fall = in.time_step * wall.normal.dot(in.gravity);
  for (std::size_t k = begin; k < end; ++k) {
    const auto i = static_cast<std::size_t>(candidates.wall_pairs[k - grains].body);
    const double gap = wall.normal.dot(in.x[i] - wall.point) - in.radius[i];
    const double v_n = wall.normal.dot(u(i) - wall.velocity);
    const double gap_before = gap - half_step * v_n;
    through += std::min(0.0, gap_before) - gap > 0.5 * in.radius[i];
    double bias;
    if (constrain(in, gap, v_n, v_n + fall, slow, bias))
      found.push_back({wall.normal, bias, static_cast<std::int32_t>(k)});
  }
  return through;
}

constexpr std::size_t group_size = 16;
constexpr std::size_t groups_open = 64;

/// Deals the contacts to groups of 16 without a common grain, first fit, with one bit per group and grain;
/// what fits in none of 64 open groups (a large grain among small ones) follows, each a group of its own.
/// `order` gets places in `found`, `sizes` those of the groups. The order of the candidates (cut_chunks),
/// made once per broad phase, is what makes the groups full; this walk costs less than a sweep.
void order_in_groups(const Chunks& chunks, std::size_t chunk, const std::vector<Found>& found,
                     std::vector<std::int32_t>& order, std::uint8_t* sizes) {
  if (chunks.wall[chunk] >= 0) {  // a grain meets a wall once
    for (std::size_t f = 0; f < found.size(); ++f) order.push_back(static_cast<std::int32_t>(f));
    for (std::size_t f = 0; f < found.size(); f += group_size)
      *sizes++ = static_cast<std::uint8_t>(std::min(group_size, found.size() - f));
    return;
  }
  const auto bodies = static_cast<std::size_t>(chunks.body_begin[chunk + 1] - chunks.body_begin[chunk]);
  std::vector<std::uint64_t> in_group(bodies, 0);
  std::array<std::array<std::int32_t, group_size>, groups_open> group;
  std::array<std::size_t, groups_open> filled{};
  std::uint64_t open = ~std::uint64_t{0};
  std::vector<std::int32_t> late;
  for (std::size_t f = 0; f < found.size(); ++f) {
    const auto k = static_cast<std::size_t>(found[f].candidate);
    std::uint64_t& mask_i = in_group[chunks.local[2 * k]];
    std::uint64_t& mask_j = in_group[chunks.local[2 * k + 1]];
    const std::uint64_t room = open & ~(mask_i | mask_j);
    if (room == 0) {
      late.push_back(static_cast<std::int32_t>(f));
      continue;
    }
    const auto g = static_cast<std::size_t>(std::countr_zero(room));
    const std::uint64_t bit = std::uint64_t{1} << g;
    mask_i |= bit;
    mask_j |= bit;
    group[g][filled[g]++] = static_cast<std::int32_t>(f);
    if (filled[g] == group_size) open &= ~bit;
  }
  for (std::size_t g = 0; g < groups_open && filled[g] > 0; ++g) {
    order.insert(order.end(), group[g].begin(), group[g].begin() + static_cast<std::ptrdiff_t>(filled[g]));
    *sizes++ = static_cast<std::uint8_t>(filled[g]);
  }
  order.insert(order.end(), late.begin(), late.end());
  std::fill_n(sizes, late.size(), std::uint8_t{1});
}

}  // namespace

void allocate(Contacts& contacts, const Candidates& candidates, const Chunks& chunks, bool friction) {
  const std::size_t n = candidates.size();
  for (auto* values : {&contacts.nx, &contacts.ny, &contacts.nz, &contacts.bias}) values->resize(n);
  for (auto* values : {&contacts.rx, &contacts.ry, &contacts.rz}) {
    values->resize(friction ? n : 0);
    if (!friction) values->shrink_to_fit();
  }
  contacts.rn.resize(friction ? 0 : n);
  if (friction) contacts.rn.shrink_to_fit();
  for (auto* values : {&contacts.first, &contacts.second}) values->resize(n);
  contacts.candidate.resize(n);
  contacts.group.resize(n);
  contacts.count.assign(chunks.size(), 0);
  contacts.passed.assign(chunks.size(), 0);
}

void narrow_chunk(const NarrowPhase& in, const Candidates& candidates, const Chunks& chunks,
                  std::size_t chunk, Contacts& contacts) {
  std::vector<Found> found;
  found.reserve(static_cast<std::size_t>(chunks.begin[chunk + 1] - chunks.begin[chunk]));
  contacts.passed[chunk] = find_contacts(in, candidates, chunks, chunk, found);
  std::vector<std::int32_t> order;
  order.reserve(found.size());
  order_in_groups(chunks, chunk, found, order,
                  contacts.group.data() + static_cast<std::size_t>(chunks.begin[chunk]));

  const std::size_t grains = candidates.grain_pairs.size();
  const bool friction = candidates.components == 3;
  auto at = static_cast<std::size_t>(chunks.begin[chunk]);
  for (std::int32_t f : order) {
    const Found& contact = found[static_cast<std::size_t>(f)];
    const auto k = static_cast<std::size_t>(contact.candidate);
    contacts.nx[at] = contact.normal[0];
    contacts.ny[at] = contact.normal[1];
    contacts.nz[at] = contact.normal[2];
    contacts.bias[at] = contact.bias;
    if (friction) {
      contacts.rx[at] = candidates.impulse[3 * k];
      contacts.ry[at] = candidates.impulse[3 * k + 1];
      contacts.rz[at] = candidates.impulse[3 * k + 2];
    } else {
      contacts.rn[at] = candidates.impulse[k];
    }
    contacts.first[at] =
        k < grains ? candidates.grain_pairs[k].first : candidates.wall_pairs[k - grains].body;
    contacts.second[at] = k < grains ? candidates.grain_pairs[k].second : -1;
    contacts.candidate[at] = contact.candidate;
    ++at;
  }
  contacts.count[chunk] = static_cast<std::int32_t>(order.size());
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
                      std::span<const Wall> walls) {
  if (components == candidates.components) return;
  const std::size_t grains = candidates.grain_pairs.size();
  std::vector<double> converted(candidates.size() * static_cast<std::size_t>(components));
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    Vec3 normal;
    if (k < grains) {
      const GrainPair& pair = candidates.grain_pairs[k];
      const Vec3 d = x[static_cast<std::size_t>(pair.first)] - x[static_cast<std::size_t>(pair.second)];
      normal = unit_normal(d, d.norm());
    } else {
      normal = walls[static_cast<std::size_t>(candidates.wall_pairs[k - grains].wall)].normal;
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
                             &contacts.ry, &contacts.rz, &contacts.rn})
    bytes += values->capacity() * sizeof(double);
  return bytes +
         (contacts.first.capacity() + contacts.second.capacity() + contacts.candidate.capacity() +
          contacts.count.capacity() + contacts.passed.capacity()) *
             4 +
         contacts.group.capacity();
}

}  // namespace talus
