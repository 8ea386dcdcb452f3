#include "runtime/step/population.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

namespace talus {

namespace {

/// A sum of many steps is not exactly their product: a time is reached this part before it.
constexpr double rounding = 1e-9;

bool within(double amount, double limit) {
  return amount <= limit * (1 + amount_rounding);
}
/// Streams of insertions lie behind those of samples.
constexpr std::uint32_t first_stream = 0x8000;
constexpr std::int64_t all_at_once = std::int64_t{1} << 40, fewest_at_once = 16;
/// Grains of a rule that may wait for room, whose numbers every rank keeps. A rate that is a slip of the pen
/// would fill all memory within a step.
constexpr std::size_t most_waiting = std::size_t{1} << 24;

/// Time on the clock of a rule.
double rule_time(const RuleTimes& times, const StepSpan& step, double time) {
  return times.stage.empty() ? time : time - step.stage_began;
}

/// A body to be removed.
struct Leaving {
  std::int64_t id, rule, material;
  double mass;
};

std::size_t materials_of(const Setup& setup) {
  return std::max<std::size_t>(1, setup.material_names.size());
}

}  // namespace

Population::Population(const Setup& setup, const Bodies& bodies, const graph::Communicator& ranks)
    : Population(setup, [&] {
        PopulationState state;
        const std::size_t i = setup.inserts.size(), r = setup.removes.size();
        if (i + r == 0) return state;
        double largest[1] = {-1};
        for (const BodyId id : bodies.id) largest[0] = std::max(largest[0], static_cast<double>(id));
        ranks.max(largest);
        state.next_id = static_cast<std::int64_t>(largest[0]) + 1;
        for (auto* numbers :
             {&state.drawn, &state.placed, &state.no_room, &state.rounds, &state.waiting_count})
          numbers->assign(i, 0);
        state.drawn_mass.assign(i, 0);
        state.placed_mass.assign(i, 0);
        state.window.assign(i, all_at_once);
        state.last.assign(i + r, -std::numeric_limits<double>::infinity());
        state.passed.assign(r, 0);
        state.removed.assign(r * materials_of(setup), 0);
        state.removed_mass.assign(r * materials_of(setup), 0);
        return state;
      }()) {}

Population::Population(const Setup& setup, const PopulationState& state) : setup_(setup) {
  for (const InsertRule& rule : setup.inserts) radii_.emplace_back(rule.radii);
  go_on_from(state);
}

void Population::go_on_from(const PopulationState& state) {
  const std::size_t i = setup_.inserts.size(), r = setup_.removes.size();
  const auto waiting = static_cast<std::size_t>(
      std::accumulate(state.waiting_count.begin(), state.waiting_count.end(), std::int64_t{0}));
  if (state.drawn.size() != i || state.drawn_mass.size() != i || state.placed.size() != i ||
      state.placed_mass.size() != i || state.no_room.size() != i || state.rounds.size() != i ||
      state.window.size() != i || state.waiting_count.size() != i || state.waiting.size() != waiting ||
      state.last.size() != i + r || state.passed.size() != r ||
      state.tracked_rule.size() != state.tracked_id.size() ||
      std::ranges::any_of(state.waiting_count, [](std::int64_t count) { return count < 0; }) ||
      std::ranges::any_of(
          state.tracked_rule,
          [&](std::int64_t rule) { return rule < 0 || static_cast<std::size_t>(rule) >= i; }) ||
      state.removed.size() != r * materials_of(setup_) ||
      state.removed_mass.size() != r * materials_of(setup_))
    throw std::invalid_argument("the checkpoint has other insertions and removals than the scene");
  now_ = state;
  waiting_.clear();
  auto next = state.waiting.begin();
  for (const std::int64_t count : state.waiting_count) {
    waiting_.emplace_back(next, next + count);
    next += count;
  }
}

PopulationState Population::state() const {
  PopulationState state = now_;
  state.waiting.clear();
  for (std::size_t i = 0; i < waiting_.size(); ++i) {
    state.waiting_count[i] = static_cast<std::int64_t>(waiting_[i].size());
    state.waiting.insert(state.waiting.end(), waiting_[i].begin(), waiting_[i].end());
  }
  return state;
}

bool Population::acts(const RuleTimes& times, const StepSpan& step) const {
  if (!times.stage.empty() && times.stage != step.stage->name) return false;
  const double tiny = rounding * (step.end - step.begin);
  return rule_time(times, step, step.end) > times.from + tiny &&
         rule_time(times, step, step.begin) < times.until - tiny;
}

bool Population::is_occasion(const RuleTimes& times, std::size_t rule, const StepSpan& step) {
  if (!acts(times, step) || step.end - now_.last[rule] < times.interval * (1 - rounding)) return false;
  now_.last[rule] = step.end;
  return true;
}

double Population::radius_of_grain(std::size_t rule, std::int64_t number) const {
  const auto stream = first_stream + static_cast<std::uint32_t>(rule);
  return radii_[rule].of({setup_.seed, stream, static_cast<std::uint64_t>(number)});
}

double Population::mass_of_grain(std::size_t rule, std::int64_t number) const {
  return sphere_mass(radius_of_grain(rule, number), setup_.inserts[rule].density);
}

/// Grains that are due by the end of the step begin to wait.
void Population::draw_due(std::size_t i, const StepSpan& step) {
  const InsertRule& rule = setup_.inserts[i];
  const double time = std::min(rule_time(rule.times, step, step.end), rule.times.until) - rule.times.from;
  for (;;) {
    const auto next = static_cast<double>(now_.drawn[i] + 1);
    if ((rule.count && now_.drawn[i] >= *rule.count) || (rule.rate && !within(next, *rule.rate * time)))
      return;
    const double mass = mass_of_grain(i, now_.drawn[i]), all = now_.drawn_mass[i] + mass;
    if ((rule.mass && !within(all, *rule.mass)) || (rule.mass_rate && !within(all, *rule.mass_rate * time)))
      return;
    if (waiting_[i].size() == most_waiting)
      throw std::runtime_error(fmt::format(
          "insert '{}': more than {} grains are due and wait for room. Give a lower `count`, `mass` "
          "or rate, or a larger region",
          rule.name, most_waiting));
    waiting_[i].push_back(now_.drawn[i]++);
    now_.drawn_mass[i] = all;
  }
}

NewGrain Population::made(std::size_t i, std::int64_t number, const Vec3& x) {
  const InsertRule& rule = setup_.inserts[i];
  const double radius = radius_of_grain(i, number);
  NewGrain grain{{BodyId{now_.next_id++}, x, radius, rule.density}, rule.material, {}};
  const Vec3 spin = radius * rule.angular_velocity;
  for (Eigen::Index k = 0; k < 3; ++k) {
    grain.velocity[static_cast<std::size_t>(k)] = rule.velocity[k];
    grain.velocity[static_cast<std::size_t>(k + 3)] = spin[k];
  }
  if (rule.track) {
    now_.tracked_rule.push_back(static_cast<std::int64_t>(i));
    now_.tracked_id.push_back(static_cast<std::int64_t>(grain.grain.id));
  }
  ++now_.placed[i];
  now_.placed_mass[i] += mass_of_grain(i, number);
  return grain;
}

/// The first of the grains that wait, as many as are tried: no more than the region has volume for, since the
/// pairs of places that overlap grow with the square of those that are tried together.
std::vector<Seeker> Population::seekers_of(std::size_t i) const {
  const Bounds bounds = bounds_of(setup_.inserts[i].region);
  const double reach = largest_radius(setup_.inserts[i].radii);  // out of a disc, which is flat
  const double room = (bounds.high - bounds.low + Vec3::Constant(2 * reach)).prod();
  std::vector<Seeker> seekers;
  double volume = 0;
  for (const std::int64_t number : waiting_[i]) {
    if (static_cast<std::int64_t>(seekers.size()) == now_.window[i] || volume > room) break;
    const double radius = radius_of_grain(i, number);
    seekers.push_back({static_cast<std::uint64_t>(number), radius});
    volume += sphere_mass(radius, 1);
  }
  return seekers;
}

/// Looks for room for the grains that wait. After an occasion with too little room, not many more are tried
/// than found some, so that full regions cost little.
void Population::place_due(std::size_t i, const StepState& state, const graph::Communicator& ranks,
                           std::vector<NewGrain>& grains) {
  const InsertRule& rule = setup_.inserts[i];
  std::vector<std::int64_t>& waiting = waiting_[i];
  const std::vector<Seeker> seekers = seekers_of(i);
  const std::size_t count = seekers.size();
  if (count == 0) return;
  Spheres taken;
  for (const NewGrain& grain : grains) {
    taken.x.push_back(grain.grain.x);
    taken.radius.push_back(grain.grain.radius);
  }
  const PlaceDraw draw{setup_.seed, first_stream + static_cast<std::uint32_t>(i), now_.rounds[i],
                       rule.attempts};
  const auto [places, rounds] = find_places(rule.region, seekers, draw, state, taken, ranks);
  now_.rounds[i] += rounds;
  for (const FoundPlace& place : places) {
    grains.push_back(made(i, waiting[place.seeker], place.x));
    waiting[place.seeker] = -1;
  }
  std::erase(waiting, -1);
  const auto found = static_cast<std::int64_t>(places.size());
  if (places.size() < count) {
    ++now_.no_room[i];
    now_.window[i] = std::max(fewest_at_once, 2 * found);
  } else {
    now_.window[i] = std::min(all_at_once, 2 * now_.window[i]);
  }
}

/// Ids of the bodies to remove, ascending. Collective.
std::vector<std::int64_t> Population::leave(const StepSpan& step, const StepState& state,
                                            const graph::Communicator& ranks) {
  std::vector<std::size_t> acting;
  for (std::size_t r = 0; r < setup_.removes.size(); ++r) {
    const RemoveRule& rule = setup_.removes[r];
    const double tiny = rounding * (step.end - step.begin), time = rule_time(rule.times, step, step.end);
    bool due = rule.at.empty();
    if (acts(rule.times, step))
      for (auto& passed = now_.passed[r]; passed < static_cast<std::int64_t>(rule.at.size()) &&
                                          time > rule.at[static_cast<std::size_t>(passed)] + tiny;
           ++passed)
        due = true;
    if (due && is_occasion(rule.times, setup_.inserts.size() + r, step)) acting.push_back(r);
  }
  if (acting.empty()) return {};
  const Bodies& bodies = state.bodies;
  std::vector<Leaving> leaving;
  for (std::size_t s = 0; s < bodies.size(); ++s) {
    if (!counts(state.decomposition, s)) continue;
    const Material material = bodies.material.empty() ? Material{0} : bodies.material[s];
    const auto takes = [&](std::size_t r) {
      const RemoveRule& rule = setup_.removes[r];
      return (!rule.material || *rule.material == material) && contains(rule.region, bodies.x[s]);
    };
    const auto rule = std::ranges::find_if(acting, takes);
    if (rule == acting.end()) continue;
    const double inverse = whole_velocity(state.decomposition, bodies, s).inv_mass;
    leaving.push_back({static_cast<std::int64_t>(bodies.id[s]), static_cast<std::int64_t>(*rule),
                       std::int64_t{material}, inverse > 0 ? 1 / inverse : 0});
  }
  leaving = ranks.gather_records(std::span<const Leaving>(leaving));
  std::ranges::sort(leaving, {}, &Leaving::id);
  std::vector<std::int64_t> ids;
  for (const Leaving& body : leaving) {
    ids.push_back(body.id);
    const std::size_t at =
        static_cast<std::size_t>(body.rule) * materials_of(setup_) + static_cast<std::size_t>(body.material);
    ++now_.removed[at];
    now_.removed_mass[at] += body.mass;
  }
  return ids;
}

bool Population::change(const StepSpan& step, StepState& state, const graph::Communicator& ranks) {
  const std::vector<std::int64_t> gone = leave(step, state, ranks);
  if (!gone.empty()) drop_bodies(gone, state);
  std::vector<NewGrain> grains;
  for (std::size_t i = 0; i < setup_.inserts.size(); ++i) {
    if (!is_occasion(setup_.inserts[i].times, i, step)) continue;
    draw_due(i, step);
    place_due(i, state, ranks, grains);
  }
  if (!grains.empty()) add_bodies(grains, setup_, ranks, state);
  if (gone.empty() && grains.empty()) return false;
  // Several subdomains are sorted whenever they are dealt out.
  now_.unsorted += static_cast<std::int64_t>(grains.size());
  if (!state.decomposition.several() && 8 * now_.unsorted > static_cast<std::int64_t>(state.bodies.size())) {
    sort_bodies(state);
    now_.unsorted = 0;
  }
  return true;
}

bool Population::expects_grains(const StepSpan& step) const {
  for (std::size_t i = 0; i < setup_.inserts.size(); ++i) {
    const InsertRule& rule = setup_.inserts[i];
    if (!rule.times.stage.empty() && rule.times.stage != step.stage->name) continue;
    if (rule_time(rule.times, step, step.end) >= rule.times.until) continue;
    if (!waiting_[i].empty()) return true;
    const bool all_drawn =
        (rule.count && now_.drawn[i] >= *rule.count) ||
        (rule.mass && !within(now_.drawn_mass[i] + mass_of_grain(i, now_.drawn[i]), *rule.mass));
    if (!all_drawn) return true;
  }
  return false;
}

double Population::fastest(const StepSpan& step) const {
  double speed = 0;
  for (const InsertRule& rule : setup_.inserts)
    if (acts(rule.times, step)) speed = std::max(speed, rule.velocity.norm());
  return speed;
}

std::vector<NamedBody> Population::tracked() const {
  std::vector<NamedBody> bodies;
  std::vector<std::int64_t> before(setup_.inserts.size(), 0);
  for (std::size_t k = 0; k < now_.tracked_id.size(); ++k) {
    const auto i = static_cast<std::size_t>(now_.tracked_rule[k]);
    const InsertRule& rule = setup_.inserts[i];
    ++before[i];
    bodies.push_back({rule.count == 1 ? rule.name : rule.name + "-" + std::to_string(before[i]),
                      BodyId{now_.tracked_id[k]}});
  }
  return bodies;
}

std::vector<InsertReport> Population::inserted() const {
  std::vector<InsertReport> reports;
  for (std::size_t i = 0; i < setup_.inserts.size(); ++i)
    reports.push_back({setup_.inserts[i].name, now_.placed[i], now_.placed_mass[i],
                       static_cast<std::int64_t>(waiting_[i].size()), now_.no_room[i]});
  return reports;
}

std::vector<RemoveReport> Population::removed() const {
  std::vector<RemoveReport> reports;
  const std::size_t materials = materials_of(setup_);
  for (std::size_t k = 0; k < now_.removed.size(); ++k)
    reports.push_back({setup_.removes[k / materials].name,
                       setup_.material_names.empty() ? "" : setup_.material_names[k % materials],
                       now_.removed[k], now_.removed_mass[k]});
  return reports;
}

double smallest_ever(const Setup& setup, double smallest_of_sample) {
  double smallest = smallest_of_sample > 0 ? smallest_of_sample : std::numeric_limits<double>::infinity();
  for (const InsertRule& rule : setup.inserts) smallest = std::min(smallest, smallest_radius(rule.radii));
  return smallest;
}

}  // namespace talus
