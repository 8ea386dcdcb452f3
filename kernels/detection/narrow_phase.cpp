#include "kernels/detection/narrow_phase.hpp"

#include <algorithm>

#include "kernels/bodies/index.hpp"
#include "kernels/detection/detail/block_phase.hpp"
#include "kernels/detection/detail/contact_groups.hpp"
#include "kernels/detection/detail/gap_kernels.hpp"
#include "kernels/detection/detail/passing.hpp"
#include "kernels/detection/detail/path_touch.hpp"
#include "kernels/detection/materials.hpp"
#include "kernels/law/gap_law.hpp"
#include "kernels/simd/contact_view.hpp"

namespace talus {

namespace {

struct Pairing {
  Vec3 d;  ///< x_i - x_j
  Vec3 v;  ///< u_i - u_j
  double radius_i, radius_j;
};
Pairing meet(const PairView& pairs, const Domain& domain, std::size_t k) {
  const std::size_t i = pairs.first[k] / record_numbers, j = pairs.second[k] / record_numbers;
  using Map = Eigen::Map<const Vec3>;
  const Vec3 x_i = Map(pairs.x + 3 * i), x_j = Map(pairs.x + 3 * j);
  return {domain.separation(x_i, x_j),
          Map(pairs.velocity + pairs.first[k]) - Map(pairs.velocity + pairs.second[k]) -
              domain.image_velocity(x_i, x_j),
          pairs.radius[i], pairs.radius[j]};
}

std::int32_t count_passed(const PairView& pairs, const Domain& domain, double time_step) {
  std::int32_t through = 0;
  for (std::size_t k = 0; k < pairs.count; ++k) {
    const Pairing pair = meet(pairs, domain, k);
    through += detail::passed(pair.d, time_step * pair.v, pair.radius_i + pair.radius_j,
                              std::min(pair.radius_i, pair.radius_j), detail::deep_of_spheres);
  }
  return through;
}

/// The kernel of `set`; `automatic` means the widest instruction set that runs here.
FindGaps kernel_of(InstructionSet set) {
  if (set == InstructionSet::automatic) set = best_instruction_set();
  if (set == InstructionSet::portable) return gap_kernels_portable;
  return set == InstructionSet::avx2 ? gap_kernels_avx2 : gap_kernels_avx512;
}

MaterialView materials_of(const NarrowPhase& in) {
  return {in.material, in.walls};
}

/// Input of the narrow phase of one chunk.
struct ChunkPhase {
  const NarrowPhase& in;
  GapRule rule;
  const Candidates& candidates;
  const Chunks& chunks;
  std::size_t chunk;
};

/// Of each pair of a chunk that mixes laws, in the places of `contacts`; empty for other chunks.
struct OwnLaws {
  std::vector<double> restitution, reach;
};
OwnLaws own_laws(const ChunkPhase& phase, std::span<const ContactBody> first,
                 std::span<const ContactBody> second) {
  OwnLaws own;
  if (phase.chunks.law[phase.chunk] != mixed_laws) return own;
  const MaterialView materials = materials_of(phase.in);
  own.restitution.reserve(first.size());
  own.reach.reserve(first.size());
  for (std::size_t k = 0; k < first.size(); ++k) {
    const PairLaw& law = phase.in.laws.laws()[materials.law(GrainPair{first[k], second[k]})];
    own.restitution.push_back(law.restitution);
    own.reach.push_back(law.reach());
  }
  return own;
}

void narrow_grains(const ChunkPhase& phase, InstructionSet set, Contacts& contacts) {
  const auto& [in, rule, candidates, chunks, chunk] = phase;
  const std::size_t begin = at(chunks.begin[chunk]), count = at(chunks.begin[chunk + 1]) - begin;
  const auto first = std::span<const ContactBody>(contacts.first).subspan(begin, count),
             second = std::span<const ContactBody>(contacts.second).subspan(begin, count);
  std::vector<std::int64_t> contact(count);
  static_assert(sizeof(Vec3) == 3 * sizeof(double) && sizeof(Velocity) == record_numbers * sizeof(double));
  const OwnLaws own = own_laws(phase, first, second);
  const PairView pairs{in.x.data()->data(),
                       in.radius.data(),
                       in.velocity.data()->u,
                       record_places(first.data()),
                       record_places(second.data()),
                       count,
                       own.restitution.empty() ? nullptr : own.restitution.data(),
                       own.reach.empty() ? nullptr : own.reach.data(),
                       in.domain.repeats ? &in.domain.cell : nullptr,
                       in.domain.flows ? &in.domain.rates : nullptr};
  const GapTarget target{contacts.nx.data() + begin, contacts.ny.data() + begin, contacts.nz.data() + begin,
                         contacts.bias.data() + begin, contact.data()};
  const bool far = kernel_of(set)(pairs, rule, target);
  contacts.passed[chunk] = far ? count_passed(pairs, in.domain, in.time_step) : 0;
  const detail::ChunkPlaces places{chunks, chunk, contacts, contact};
  if (!detail::repair_groups(places)) detail::deal_groups(places);
  if (!in.domain.flows) return;
  for (std::size_t k = begin; k < begin + at(contacts.count[chunk]); ++k) {
    const Vec3 &x = in.x[at(contacts.first[k])], &other = in.x[at(contacts.second[k])];
    set_drift(contacts, k, in.domain.image_drift(x, other));
    if (in.cell_length > 0) contacts.reach[k] = in.domain.separation(x, other).norm() / in.cell_length;
  }
}

/// The law of a grain at a wall.
const PairLaw& law_of(const ChunkPhase& phase, const WallPair& pair) {
  return phase.in.laws.laws()[materials_of(phase.in).law(pair)];
}

/// Writes the velocity of the wall's material beyond that of the wall, where contacts have room for it.
void write_drift(const ChunkPhase& phase, const Vec3& n, std::size_t place, Contacts& contacts) {
  if (contacts.vx.empty()) return;
  const auto i = at(contacts.first[place]);
  const Wall& wall = phase.in.walls[at(phase.chunks.wall[phase.chunk])];
  const Vec3 point = phase.in.x[i] - phase.in.radius[i] * n;
  const Eigen::Map<const Vec3> u(phase.in.velocity[i].u);
  Vec3 drift = wall.drift_at(point, n, wall.half_way(point, n, u, phase.in.time_step));
  if (phase.in.domain.flows) drift += phase.in.domain.flow_drift(phase.in.x[i]);
  set_drift(contacts, place, drift);
}

/// Finds the contacts of a chunk at a plane.
void narrow_wall(const ChunkPhase& phase, Contacts& contacts) {
  const auto& [in, rule, candidates, chunks, chunk] = phase;
  const std::size_t grains = candidates.grain_pairs.size(), begin = at(chunks.begin[chunk]);
  const Wall& wall = in.walls[at(chunks.wall[chunk])];
  const double fall = wall.normal.dot(in.time_step * in.gravity - wall.gain);
  std::int32_t through = 0;
  std::size_t place = begin;
  for (std::size_t k = begin; k < at(chunks.begin[chunk + 1]); ++k) {
    const WallPair& pair = candidates.wall_pairs[k - grains];
    const Slot body = pair.body;
    const std::size_t i = at(body);
    const double gap = wall.normal.dot(in.domain.separation(in.x[i], wall.point)) - in.radius[i];
    const double v_n = wall.normal.dot(Eigen::Map<const Vec3>(in.velocity[i].u) - wall.velocity_at(in.x[i]));
    const double came = wall.normal.dot(Eigen::Map<const Vec3>(in.velocity[i].u) - wall.came_at(in.x[i]));
    through += std::min(0.0, gap - in.time_step * came) - gap > 0.5 * in.radius[i];
    const PairLaw& law = law_of(phase, pair);
    const GapResult<double> found =
        solve_gap(rule, gap, v_n, v_n + fall, law.restitution, law.reach() * in.radius[i]);
    if (found.absent) continue;
    contacts.bias[place] = found.bias;
    contacts.nx[place] = wall.normal[0];
    contacts.ny[place] = wall.normal[1];
    contacts.nz[place] = wall.normal[2];
    contacts.first[place] = body;
    write_drift(phase, wall.normal, place, contacts);
    contacts.second[place] = -1;
    contacts.candidate[place++] = static_cast<std::int32_t>(k);
  }
  contacts.passed[chunk] = through;
  detail::close_groups(chunks, chunk, place, contacts);
}

/// Finds the contacts of a chunk at a surface. The chunk has each grain once, with one feature that it may
/// touch.
void narrow_surface(const ChunkPhase& phase, Contacts& contacts) {
  const auto& [in, rule, candidates, chunks, chunk] = phase;
  const std::size_t grains = candidates.grain_pairs.size(), begin = at(chunks.begin[chunk]);
  const Wall& of = in.walls[at(chunks.wall[chunk])];
  std::int32_t through = 0;
  std::size_t place = begin;
  std::vector<SurfacePoint> points;
  for (std::size_t k = begin; k < at(chunks.begin[chunk + 1]); ++k) {
    const WallPair& pair = candidates.wall_pairs[k - grains];
    const auto [wall, body, feature] = pair;
    const std::size_t i = at(body);
    // The point lies along the normal from the centre, so its velocity along the normal is that at the
    // centre.
    const Vec3 u = Eigen::Map<const Vec3>(in.velocity[i].u), v = u - of.velocity_at(in.x[i]),
               free = v + in.time_step * in.gravity;
    // Asked first: from deep in a solid no feature is to be seen any more.
    through +=
        detail::passed_surface(of, in.x[i], in.time_step * (u - of.came_at(in.x[i])), in.radius[i]) ? 1 : 0;
    points.clear();
    collide(of, in.x[i], in.radius[i] + in.alert + in.time_step * free.norm(), points);
    const auto point = std::ranges::find(points, feature, &SurfacePoint::feature);
    if (point == points.end()) continue;
    const PairLaw& law = law_of(phase, pair);
    const SurfacePoint met =
        detail::touch_on_path(of, in.x[i], in.radius[i],
                              {in.time_step * v, in.time_step * free, law.reach() * in.radius[i]}, *point);
    const GapResult<double> found =
        solve_gap(rule, met.distance - in.radius[i], met.normal.dot(v), met.normal.dot(free), law.restitution,
                  law.reach() * in.radius[i]);
    if (found.absent || at_seam(in.walls, at(chunks.wall[chunk]), in.x[i], in.radius[i], *point)) continue;
    contacts.bias[place] = found.bias;
    contacts.nx[place] = met.normal[0];
    contacts.ny[place] = met.normal[1];
    contacts.nz[place] = met.normal[2];
    contacts.first[place] = body;
    write_drift(phase, met.normal, place, contacts);
    contacts.second[place] = -1 - feature;
    contacts.candidate[place++] = static_cast<std::int32_t>(k);
  }
  contacts.passed[chunk] = through;
  detail::close_groups(chunks, chunk, place, contacts);
}

}  // namespace

void narrow_chunk(const NarrowPhase& in, const Candidates& candidates, const Chunks& chunks,
                  std::size_t chunk, InstructionSet set, Contacts& contacts) {
  const std::int32_t law = chunks.law[chunk];
  const PairLaw one = law == mixed_laws ? PairLaw{} : in.laws.laws()[at(law)];
  const ChunkPhase phase{in,
                         {in.time_step, in.alert, one.restitution, 2 * in.time_step * in.gravity.norm(),
                          in.turning, in.reflection, one.reach()},
                         candidates,
                         chunks,
                         chunk};
  if (chunks.kind[chunk] == ChunkKind::blocks)
    detail::narrow_blocks(in, phase.rule, candidates, chunks, chunk, contacts);
  else if (chunks.wall[chunk] < 0)
    narrow_grains(phase, set, contacts);
  else if (in.walls[at(chunks.wall[chunk])].surface() == nullptr)
    narrow_wall(phase, contacts);
  else
    narrow_surface(phase, contacts);
  set_friction(candidates, chunks, chunk, materials_of(in), in.laws, contacts);
  restore_impulses(candidates, chunks, chunk, contacts);
  turn_moments(chunks, chunk, contacts);
}

}  // namespace talus
