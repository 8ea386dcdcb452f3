#include "runtime/step/probe_contents.hpp"

#include <algorithm>

#include "kernels/detection/touch.hpp"
#include "kernels/shapes/region_parts.hpp"

namespace talus {

namespace {

RegionSums no_sums(std::size_t materials) {
  RegionSums sums;
  sums.counts.assign(materials, 0);
  sums.masses.assign(materials, 0);
  return sums;
}

/// The sums as the numbers that are sent.
constexpr std::size_t fixed_numbers = 1 + 1 + 3 + 9 + 1 + 1 + 9;
std::size_t numbers_of_region(std::size_t materials) {
  return fixed_numbers + 2 * materials;
}

void append(const RegionSums& sums, std::vector<double>& numbers) {
  const auto put = [&](const auto& values) {
    for (const auto value : values) numbers.push_back(static_cast<double>(value));
  };
  put(std::array{static_cast<double>(sums.motion.count), sums.motion.mass, sums.volume,
                 static_cast<double>(sums.ends)});
  put(std::span(sums.motion.mean.data(), 3));
  put(std::span(sums.motion.spread.data(), 9));
  put(std::span(sums.moment.data(), 9));
  put(sums.counts);
  put(sums.masses);
}

void add(const double* numbers, RegionSums& to) {
  MassMoments motion;
  motion.count = static_cast<std::int64_t>(numbers[0]);
  motion.mass = numbers[1];
  motion.mean = Eigen::Map<const Vec3>(numbers + 4);
  motion.spread = Eigen::Map<const Mat3>(numbers + 7);
  to.motion.add(motion);
  to.volume += numbers[2];
  to.ends += static_cast<std::int64_t>(numbers[3]);
  to.moment += Eigen::Map<const Mat3>(numbers + 16);
  const std::size_t materials = to.counts.size();
  for (std::size_t m = 0; m < materials; ++m) {
    to.counts[m] += static_cast<std::int64_t>(numbers[fixed_numbers + m]);
    to.masses[m] += numbers[fixed_numbers + materials + m];
  }
}

/// Calls visit(k, image) for the images of x that lie no further than `reach` [m] along every axis from the
/// box around the region. A half space bounds an axis of walls: nearer images are as deep in it.
template <class Visit>
void each_image_near(const Region& region, const Domain& domain, const Vec3& x, const Vec3& reach,
                     const Visit& visit) {
  if (!domain.repeats || region.kind == Region::Kind::beyond) return visit(Vec3(Vec3::Zero()), x);
  const Bounds box = bounds_of(region);
  domain.each_image_in({box.low - reach, box.high + reach}, x, visit);
}

void add_body(const StepState& state, std::size_t s, const Region& region, RegionSums& to) {
  const Bodies& bodies = state.bodies;
  const ClumpView clumps = clumps_of(state);
  const double radius = bodies.radius[s];
  const Velocity v = whole_velocity(state.decomposition, bodies, s);
  const double mass = v.inv_mass > 0 ? 1 / v.inv_mass : 0;
  each_image_near(region, state.domain, bodies.x[s], Vec3::Constant(radius),
                  [&](const Vec3& edges, const Vec3& x) {
                    const bool in = contains(region, x);
                    if (!clumps.is_clump(s))
                      to.volume += sphere_part(region, x, radius);
                    else if (in)
                      to.volume += clumps.of(s).volume * radius * radius * radius;
                    if (!in) return;
                    to.motion.add(mass, Vec3(v.u) + Domain::times(state.domain.rates, edges));
                    const std::size_t material = bodies.material.empty() ? 0 : bodies.material[s];
                    ++to.counts[material];
                    to.masses[material] += mass;
                  });
}

void add_contact(const StepState& state, const Poses& poses, std::size_t k, const Wall* wall,
                 std::span<const Region> regions, RegionSums* to) {
  const Vec3 impulse = contact_impulse(state.contacts, k);
  const bool active = is_active(state.contacts, k);
  if (!active && impulse == Vec3::Zero()) return;
  const Vec3& x = poses.x[static_cast<std::size_t>(state.contacts.first[k])];
  const Vec3 branch = branch_of(poses, state.contacts, k, wall);
  for (std::size_t p = 0; p < regions.size(); ++p)
    each_image_near(regions[p], state.domain, x, branch.cwiseAbs(), [&](const Vec3&, const Vec3& first) {
      if (active)
        to[p].ends += (contains(regions[p], first) ? 1 : 0) +
                      (wall == nullptr && contains(regions[p], first - branch) ? 1 : 0);
      if (const double part = way_part(regions[p], first, first - branch); part > 0)
        to[p].moment += part * impulse * branch.transpose();
    });
}

}  // namespace

std::vector<RegionSums> sum_over_regions(std::span<const Region> regions, std::size_t materials,
                                         const StepState& state, const graph::Communicator& ranks) {
  const Decomposition& all = state.decomposition;
  std::vector<RegionSums> sums(all.here.size() * regions.size(), no_sums(materials));
  for (const SubdomainPlace e : all.here.indices()) {
    const SlotRange range = all.several() ? all.slots_of(e) : SlotRange{0, state.bodies.size()};
    for (std::size_t s = range.begin; s < range.end; ++s)
      for (std::size_t p = 0; counts(all, s) && p < regions.size(); ++p)
        add_body(state, s, regions[p], sums[e.at() * regions.size() + p]);
  }
  const Poses poses = poses_of(state);
  for (std::size_t c = 0; c < state.chunks.size(); ++c) {
    const std::int32_t w = state.chunks.wall[c];
    const Wall* const wall = w < 0 ? nullptr : &state.walls[static_cast<std::size_t>(w)];
    const auto begin = static_cast<std::size_t>(state.chunks.begin[c]);
    for (std::size_t k = begin; k < begin + static_cast<std::size_t>(state.contacts.count[c]); ++k)
      add_contact(state, poses, k, wall, regions,
                  &sums[static_cast<std::size_t>(state.chunks.subdomain[c]) * regions.size()]);
  }
  const std::size_t width = 1 + numbers_of_region(materials) * regions.size();
  std::vector<double> rows;
  for (const SubdomainPlace e : all.here.indices()) {
    rows.push_back(static_cast<double>(all.here[e].value()));
    for (std::size_t p = 0; p < regions.size(); ++p) append(sums[e.at() * regions.size() + p], rows);
  }
  rows = ranks.gather_records(std::span<const double>(rows));
  std::vector<const double*> by_subdomain(static_cast<std::size_t>(all.partition.subdomains));
  for (std::size_t k = 0; k < rows.size(); k += width)
    by_subdomain[static_cast<std::size_t>(rows[k])] = &rows[k + 1];
  std::vector<RegionSums> whole(regions.size(), no_sums(materials));
  for (const double* numbers : by_subdomain)
    for (std::size_t p = 0; p < regions.size(); ++p)
      add(numbers + p * numbers_of_region(materials), whole[p]);
  return whole;
}

}  // namespace talus
