/// Tasks of a step except detection (step_detection.cpp); step_graph.cpp puts them in order.

#include <algorithm>
#include <limits>

#include "kernels/detection/unseen.hpp"
#include "kernels/shapes/clump_motion.hpp"
#include "runtime/graph/clock.hpp"
#include "runtime/step/step_graph.hpp"
#include "runtime/step/used_reach.hpp"
#include "runtime/trace/order.hpp"

namespace talus {

SlotRange StepGraph::range_of_share(std::size_t count, std::uint32_t share) const {
  return {count * share / shares_, count * (share + 1) / shares_};
}

/// Slots of a share: a share of one subdomain.
SlotRange StepGraph::slots(std::uint32_t share) const {
  const SubdomainPlace e(share / shares_per_subdomain_);
  const std::size_t part = share % shares_per_subdomain_;
  const Decomposition& all = state_.decomposition;
  const auto [begin, end] = all.several() ? all.slots_of(e) : SlotRange{0, state_.bodies.size()};
  const std::size_t count = end - begin;
  return {begin + count * part / shares_per_subdomain_, begin + count * (part + 1) / shares_per_subdomain_};
}

bool StepGraph::partition_due() const {
  return steps_ - partitioned_ >= decomposition_.repartition_every || out_of_balance();
}

/// Whether space is to be cut anew because of the imbalance. Not if the imbalance has never been much smaller
/// since the last cut, as the sample may not be divisible any better; nor if contacts are so few that their
/// places are chance. A partition made before candidates were known is always replaced once they are.
bool StepGraph::out_of_balance() const {
  constexpr std::int64_t few = 16;
  if (!state_.decomposition.several()) return false;
  const std::int64_t contacts = contacts_before_;
  if (state_.decomposition.blind && contacts > 0) return true;
  const double imbalance = imbalance_before_;
  return contacts > few * state_.decomposition.partition.subdomains &&
         imbalance > decomposition_.max_imbalance && imbalance > 1.25 * imbalance_then_;
}

/// Work of each subdomain of this rank, in candidates: its candidates, and the cost of its interface
/// (docs/performance.md, "Scaling, predicted"). The same on any ranks.
std::vector<double> StepGraph::work() const {
  constexpr double wall = 1,  // more than between grains
      copy = 1.3,             // to send one and to take one
      neighbour = 100;        // a message sent and one taken, 0.3 us each
  std::vector<double> work;
  for (const SubdomainInterface& interface : state_.decomposition.interfaces)
    work.push_back(copy * static_cast<double>(interface.exchange.size()) +
                   neighbour * static_cast<double>(interface.neighbours.size()));
  const Chunks& chunks = state_.chunks;
  for (std::size_t c = 0; c < chunks.size(); ++c)
    work[static_cast<std::size_t>(chunks.subdomain[c])] +=
        (chunks.wall[c] < 0 ? 1 : 1 + wall) * (chunks.begin[c + 1] - chunks.begin[c]);
  return work;
}

/// Per subdomain: the work of a candidate over the mean, from the work of those here. Collective.
Per<SubdomainId, double> StepGraph::costs(std::span<const double> work) const {
  struct Row {
    double subdomain, work, candidates;
  };
  const Decomposition& all = state_.decomposition;
  std::vector<Row> rows;
  for (const SubdomainPlace e : all.here.indices())
    rows.push_back({static_cast<double>(all.here[e].value()), work[e.at()], 0});
  for (std::size_t c = 0; c < state_.chunks.size(); ++c)
    rows[static_cast<std::size_t>(state_.chunks.subdomain[c])].candidates +=
        state_.chunks.begin[c + 1] - state_.chunks.begin[c];
  rows = ranks_.gather_records(std::span<const Row>(rows));
  // In order of subdomain: the same sums on any ranks.
  std::sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.subdomain < b.subdomain; });
  double sum = 0, candidates = 0;
  for (const Row& row : rows) {
    sum += row.work;
    candidates += row.candidates;
  }
  if (sum == 0 || candidates == 0) return {};
  Per<SubdomainId, double> cost(static_cast<std::size_t>(all.partition.subdomains), 1.0);
  for (const Row& row : rows)
    if (row.candidates > 0)
      cost[SubdomainId(static_cast<std::int32_t>(row.subdomain))] =
          row.work / row.candidates * (candidates / sum);
  return cost;
}

void StepGraph::plan_iteration() {
  if (!state_.given_overlaps)
    state_.given_overlaps = given_overlaps(state_, parameters_, settings_.overlap_tolerance, ranks_);
  reset_to_free(state_.chunks.untouched, state_.free, state_.bodies.velocity);
  if (!planned_) {
    const double planning = graph::seconds_now();
    loop_.plan_tree();
    if (state_.decomposition.several()) sums_.times.dealing += graph::seconds_now() - planning;
  }
  loop_.begin();
  if (!planned_) {
    const graph::LoopPlan& plan = loop_.plan_nodes(executor_.threads());
    epochs_.build(plan.conflicts(), plan.owner, executor_.threads());
    if (executor_.trace() || executor_.times() || order_) note_plan(plan);
    planned_ = true;
  }
  followed_ = order_ && order_->begin_step(static_cast<std::uint32_t>(steps_));
  iterating_ = graph::seconds_now();
}

void StepGraph::finish_share(std::uint32_t share) {
  Bodies& bodies = state_.bodies;
  const SlotRange range = slots(share);
  const Decomposition& all = state_.decomposition;
  const bool uneven = decomposition_.coupling != Coupling::nscdd;
  if (state_.cell.loaded()) {
    const AffineGain gained{gradient_of(state_.cell.velocity, state_.cell.length), state_.domain.low};
    add_gain(range, bodies.x, gained, state_.free);
    add_gain(range, bodies.x, gained, bodies.velocity);
  }
  StepFinish end = finish_of(state_, parameters_);
  if (uneven) end.copies = {all.multiplicity, all.parts};
  motion_[share] = finish(range, bodies.x, bodies.velocity, state_.free, end);
  loop_.positions().move(range, bodies.x);
  if (!bodies.orientation.empty()) rotate(range, bodies, 0.5 * parameters_.time_step);
  turn_clumps(range, bodies, state_.clumps, 0.5 * parameters_.time_step);
}

/// Per wall: the velocity of its copies (or the displacement kept in that place), from the ranks that hold
/// one; `otherwise(wall)` if no rank holds a copy. Collective.
template <class Otherwise>
std::vector<double> StepGraph::copies_of_walls(const std::vector<WallCopy>& copies,
                                               const Otherwise& otherwise) const {
  std::vector<double> numbers(3 * state_.walls.size(), -std::numeric_limits<double>::infinity());
  for (std::size_t w = 0; w < state_.walls.size(); ++w) {
    const WallState& wall = state_.wall_states[w];
    if (!wall.copies.empty())
      std::copy_n(copies[wall.copies.front().at()].velocity, 3, &numbers[3 * w]);
    else if (wall.copies_everywhere == 0)
      std::copy_n(otherwise(wall).data(), 3, &numbers[3 * w]);
  }
  ranks_.max(numbers);
  return numbers;
}

void StepGraph::finish_walls() {
  iterated_ = graph::seconds_now();
  if (state_.domain.flows) end_flow(state_.flow, state_.domain);
  const auto velocities =
      copies_of_walls(state_.copies, [](const WallState& wall) -> const Vec3& { return wall.free_velocity; });
  for (std::size_t w = 0; w < state_.walls.size(); ++w) {
    Wall& wall = state_.walls[w];
    WallState& wall_state = state_.wall_states[w];
    const Vec3 before = wall.velocity;
    wall.velocity = Eigen::Map<const Vec3>(&velocities[3 * w]);
    if (parameters_.reflection > 0) wall.velocity += parameters_.reflection * (wall.velocity - before);
    wall_state.mean_velocity = 0.5 * (before + wall.velocity);
    if (wall.motion.empty())
      wall.point += 0.5 * parameters_.time_step * wall.velocity;
    else
      place(setup_.walls[w], wall_state.end, wall);
  }
  if (loop_.positions().found()) {
    const Vec3 stays = Vec3::Zero();
    const auto moved = copies_of_walls(loop_.positions().wall_copies(),
                                       [&](const WallState&) -> const Vec3& { return stays; });
    // The copies of a driven wall have the displacement 0.
    for (std::size_t w = 0; w < state_.walls.size(); ++w)
      state_.walls[w].point += Eigen::Map<const Vec3>(&moved[3 * w]);
  }
  contact_sums_.resize(state_.chunks.size());
  wall_sums_.resize(state_.chunks.size());
}

void StepGraph::measure_share(std::uint32_t share) {
  beyond_reach_[share] = any_beyond_reach(state_, slots(share)) ? 1 : 0;
  const SlotRange range = range_of_share(state_.chunks.size(), share);
  for (std::size_t c = range.begin; c < range.end; ++c) {
    store_impulses(state_.contacts, state_.chunks, c, state_.candidates);
    const Poses poses = poses_of(state_);
    contact_sums_[c] = measure_contacts(state_.contacts, state_.chunks, c, poses);
    double& deepest = contact_sums_[c].deepest;
    find_unseen_overlaps(state_.candidates, state_.contacts, state_.chunks, c, poses, deepest,
                         [&](const FoundOverlap& found) { deepest = std::max(deepest, found.part()); });
    wall_sums_[c] = {};
    if (const std::int32_t w = state_.chunks.wall[c]; w >= 0)
      wall_sums_[c] = measure_wall(state_.contacts, state_.chunks, c, poses,
                                   {state_.wall_states[static_cast<std::size_t>(w)].own_point,
                                    state_.bodies.velocity, 0.5 * parameters_.time_step});
  }
}

namespace {

/// The share of a subdomain in the report, as numbers that are sent.
constexpr std::size_t row_width = 1 + 9 + 15 + 1;

void write_row(SubdomainId subdomain, const MotionSums& motion, const ContactSums& contacts,
               bool beyond_reach, double* row) {
  const double head[] = {static_cast<double>(subdomain.value()),
                         motion.energy.translation,
                         motion.energy.rotation,
                         motion.energy_free,
                         motion.impulse[0],
                         motion.impulse[1],
                         motion.impulse[2],
                         motion.impulse_scale,
                         motion.speed2_max,
                         static_cast<double>(motion.fastest),
                         static_cast<double>(contacts.overlapping),
                         contacts.penetration,
                         contacts.penetration_max,
                         contacts.deepest,
                         contacts.normal_impulse,
                         static_cast<double>(contacts.passed)};
  row = std::copy(std::begin(head), std::end(head), row);
  std::copy_n(contacts.moment.data(), 9, row);
  row[9] = beyond_reach ? 1 : 0;
}

void add_row(const double* row, bool here, StepSums& sums) {
  MotionSums motion;
  motion.energy = {row[1], row[2]};
  motion.energy_free = row[3];
  motion.impulse = {row[4], row[5], row[6]};
  motion.impulse_scale = row[7];
  motion.speed2_max = row[8];
  motion.fastest = here ? static_cast<Slot>(row[9]) : -1;
  sums.motion.add(motion);
  ContactSums contacts;
  contacts.overlapping = static_cast<std::int64_t>(row[10]);
  contacts.penetration = row[11];
  contacts.penetration_max = row[12];
  contacts.deepest = row[13];
  contacts.normal_impulse = row[14];
  contacts.passed = static_cast<std::int64_t>(row[15]);
  contacts.moment = Eigen::Map<const Eigen::Matrix3d>(row + 16);
  sums.contacts.add(contacts);
  sums.bodies_beyond = sums.bodies_beyond || row[row_width - 1] > 0;
}

}  // namespace

/// Torques, and the work of the step. Impulses of the iterations are 1 / (1 + E) of those of the whole step.
void StepGraph::take_wall_sums(std::span<const double> sums) {
  for (std::size_t w = 0; w < state_.walls.size(); ++w) {
    WallState& wall = state_.wall_states[w];
    const double* const of = &sums[WallSums::width * w];
    wall.torque = Eigen::Map<const Vec3>(of);
    wall.work += (1 + parameters_.reflection) * (wall.impulse.dot(wall.mean_velocity) + of[3]);
  }
}

void StepGraph::sum_up() {
  const Decomposition& all = state_.decomposition;
  std::vector<MotionSums> motion(all.here.size());
  std::vector<ContactSums> contacts(all.here.size());
  std::vector<char> beyond(all.here.size(), 0);
  for (std::uint32_t share = 0; share < shares_; ++share) {
    motion[share / shares_per_subdomain_].add(motion_[share]);
    if (beyond_reach_[share] != 0) beyond[share / shares_per_subdomain_] = 1;
  }
  for (std::size_t c = 0; c < contact_sums_.size(); ++c)
    contacts[static_cast<std::size_t>(state_.chunks.subdomain[c])].add(contact_sums_[c]);
  const std::size_t width = row_width + WallSums::width * state_.walls.size();
  std::vector<double> rows(all.here.size() * width);
  for (const SubdomainPlace e : all.here.indices())
    write_row(all.here[e], motion[e.at()], contacts[e.at()], beyond[e.at()] != 0, &rows[e.at() * width]);
  for (std::size_t c = 0; c < wall_sums_.size(); ++c)
    if (const std::int32_t w = state_.chunks.wall[c]; w >= 0)
      wall_sums_[c].add_to(&rows[static_cast<std::size_t>(state_.chunks.subdomain[c]) * width + row_width +
                                 WallSums::width * static_cast<std::size_t>(w)]);
  rows = ranks_.gather_records(std::span<const double>(rows));
  Per<SubdomainId, const double*> by_subdomain(static_cast<std::size_t>(all.partition.subdomains));
  for (std::size_t k = 0; k < rows.size(); k += width)
    by_subdomain[SubdomainId(static_cast<std::int32_t>(rows[k]))] = &rows[k];
  std::vector<double> of_walls(width - row_width, 0.0);
  for (const SubdomainId e : by_subdomain.indices()) {
    add_row(by_subdomain[e], all.rank_of[e] == ranks_.rank(), sums_);
    for (std::size_t k = 0; k < of_walls.size(); ++k) of_walls[k] += by_subdomain[e][row_width + k];
  }
  take_wall_sums(of_walls);
  sums_.walls_beyond = walls_beyond_margin();
  sums_.candidates = all_candidates_;
  contacts_before_ = loop_.result().contacts;
  imbalance_before_ = loop_.imbalance();
  sums_.times.detection = iterating_ - started_;
  sums_.times.iteration = iterated_ - iterating_;
  sums_.times.small = loop_.take_small_seconds();
  sums_.times.rest = graph::seconds_now() - iterated_;
}

}  // namespace talus
