#include "apps/study_certificate/step_problem.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <unordered_map>
#include <vector>

#include "apps/study_certificate/touch_shapes.hpp"

namespace talus::audit {

namespace {

/// Numbers that decide which pairs are contacts. E: 0 with Newton's law, else the largest restitution.
struct GapNumbers {
  double h, alert, turning, slow, E;
};

/// A pair on its way through the step.
struct Approach {
  double gap;     ///< in the middle of the step [m]
  double v_n;     ///< before the step [m/s]
  double v_free;  ///< at its end without contacts [m/s]
  bool closed;    ///< the run says that there is none, and it may be rounding
};

/// Bodies that attract one another touch up to this gap, over the smaller radius.
constexpr double reach_of_cohesion = 1e-3;

/// Normals of one contact, in the frame's and in the problem's words, differ by less: 1 - cos.
constexpr double one_normal = 1e-9;

/// Roundings of the largest coordinate that a gap may be of.
constexpr double roundings_of_gap = 4;

/// Whether the pair is a contact; then its bias (docs/theory.md, "Gap term and restitution"). `reach` [m] of
/// cohesion.
bool meets(const GapNumbers& numbers, const Approach& pair, double restitution, double reach, double& bias) {
  if (pair.gap >= numbers.alert && pair.gap + numbers.h * pair.v_free >= 0) return false;
  bias = std::max(0.0, pair.gap) / numbers.h;
  if (restitution > 0 && std::abs(pair.v_n) > numbers.slow) {
    const bool closes = pair.v_n < 0 && pair.gap + numbers.h * pair.v_free < 0;
    if (pair.gap <= 0 || pair.closed || (closes && pair.gap < numbers.turning))
      bias = restitution * pair.v_n;
    else if (closes || (restitution >= 1 && pair.gap > reach))
      return false;
  }
  // Moreau's law: of the mean velocity (v + E v-)/(1 + E).
  if (numbers.E > 0) bias = std::max(0.0, bias - numbers.E * pair.v_n) / (1 + numbers.E);
  return true;
}

/// What rebuild_step works with.
class Builder {
 public:
  explicit Builder(const StepInput& input) : in_(input), n_(input.before.x.size()) {
    const double h = in_.stage.time_step;
    double smallest = INFINITY;
    for (double radius : in_.before.radius) smallest = std::min(smallest, radius);
    numbers_ = {h, in_.setup.detection.alert > 0 ? in_.setup.detection.alert : 0.1 * smallest, 0.5 * smallest,
                2 * h * in_.stage.gravity.norm(),
                in_.setup.solver.restitution_law == RestitutionLaw::moreau
                    ? in_.stage.laws.largest(&PairLaw::restitution)
                    : 0};
    acts_ = h / (1 + numbers_.E);
    if (in_.after == nullptr) return;
    for (const auto& [a, b] : in_.after->contact_bodies) carry_.insert({a, b});
  }

  StepProblem build() {
    made_.time_step = acts_;
    made_.reflection = numbers_.E;
    made_.gravity = in_.stage.gravity;
    take_grains();
    take_walls();
    take_cell();
    if (made_.cell.repeats)
      meet_images();
    else
      meet_grains();
    meet_walls();
    pull_together();
    return std::move(made_);
  }

 private:
  void take_grains() {
    std::unordered_map<std::int64_t, std::size_t> slots;
    for (std::size_t s = 0; s < in_.bodies.size(); ++s)
      slots.emplace(static_cast<std::int64_t>(in_.bodies.id[s]), s);
    const bool turns = in_.stage.laws.largest(&PairLaw::friction) > 0 && in_.setup.rotation;
    double farthest = 0;
    for (const Vec3& x : in_.before.x) farthest = std::max(farthest, x.cwiseAbs().maxCoeff());
    made_.rounding_speed = std::numeric_limits<double>::epsilon() * farthest / numbers_.h;
    for (std::size_t k = 0; k < n_; ++k) {
      const std::size_t s = slots.at(in_.before.id[k]);
      const double m = in_.bodies.mass(s), R = in_.before.radius[k];
      made_.mass.push_back(m);
      made_.spin_mobility.push_back(turns ? 2.5 / m : 0);
      made_.free.u.push_back(in_.before.u[k] + acts_ * in_.stage.gravity);
      made_.free.w.push_back(in_.before.omega.empty() ? Vec3::Zero() : Vec3(R * in_.before.omega[k]));
      middle_.push_back(in_.before.x[k] + numbers_.h / 2 * in_.before.u[k]);
      material_.push_back(in_.bodies.material.empty() ? material_of_grains : in_.bodies.material[s]);
    }
  }

  void take_walls() {
    for (std::size_t w = 0; w < in_.walls.size(); ++w) {
      const Wall& wall = in_.walls[w];
      const double gain = acts_ * in_.loads[w] * wall.inv_mass();
      made_.wall_normal.push_back(wall.normal);
      made_.wall_inv_mass.push_back(wall.inv_mass());
      made_.wall_load.push_back(in_.loads[w]);
      made_.free.walls.push_back(wall.motion.empty() ? Vec3(wall.velocity + gain * wall.normal)
                                                     : Vec3(Vec3::Zero()));
      if (!wall.absent && wall.load.drive == WallDrive::velocity)
        made_.drive_speed = std::max(made_.drive_speed, wall.velocity.norm());
      made_.walls_move = made_.walls_move || (!wall.absent && !wall.motion.empty());
    }
  }

  /// The cell, and what the change of its flow gives to every body.
  void take_cell() {
    made_.cell = cell_of_step(in_, made_.mass, numbers_.E);
    const StepCell& cell = made_.cell;
    if (!cell.repeats) return;
    for (std::size_t k = 0; k < n_; ++k) made_.free.u[k] += cell.gain * (middle_[k] - cell.low);
    made_.drive_speed = std::max(made_.drive_speed, cell.drive);
    // Images are as far away as the edges.
    const double farthest = cell.edges.cwiseAbs().maxCoeff() * std::numeric_limits<double>::epsilon();
    made_.rounding_speed = std::max(made_.rounding_speed, farthest / numbers_.h);
  }

  const PairLaw& law(Material a, Material b) const { return in_.stage.laws.between(a, b); }

  /// StepInput::after, of a grain and another body: the other grain's id, or -1 - w of a wall.
  bool closed_in_run(double gap, std::size_t k, std::int64_t other) const {
    if (!(gap > 0 && gap <= roundings_of_gap * made_.rounding_speed * numbers_.h)) return false;
    const std::int64_t id = in_.before.id[k];
    return carry_.contains({id, other}) || carry_.contains({other, id});
  }

  void meet(std::size_t i, std::size_t j) {
    const StepCell& cell = made_.cell;
    const Vec3 apart = middle_[i] - middle_[j], k = cell.edges_between(apart),
               d = cell.repeats ? Vec3(apart - cell.edges * k) : apart;
    const double distance = d.norm();
    const Vec3 normal = distance > 0 ? Vec3(d / distance) : Vec3(Vec3::UnitZ());
    const double v_n = normal.dot(in_.before.u[i] - in_.before.u[j] - cell.rates * k);
    const PairLaw& pair = law(material_[i], material_[j]);
    const double gap = distance - in_.before.radius[i] - in_.before.radius[j];
    const Holding held = holding(pair, in_.before.radius[i], in_.before.radius[j]);
    double bias = 0;
    const bool closed = closed_in_run(gap, i, in_.before.id[j]);
    if (!meets(numbers_, {gap, v_n, v_n, closed}, pair.restitution, held.reach, bias)) return;
    const Vec3 drift = (cell.before + cell.gain) * cell.edges * k;
    made_.contacts.push_back({i, static_cast<std::ptrdiff_t>(j), normal, bias, pair.friction, drift,
                              d / cell.length, gap <= held.reach ? acts_ * held.force : 0});
  }

  /// How a pair is held together: by so much [N] up to that gap [m].
  struct Holding {
    double force = 0, reach = 0;
  };
  static Holding holding(const PairLaw& pair, double radius, double other) {
    const double force = pair.cohesion_of({radius, other});
    return {force, force > 0 ? reach_of_cohesion * std::min(radius, other) : 0};
  }

  /// Cohesion is a given force: it belongs to what happens without contacts.
  void pull_together() {
    made_.unpulled = made_.free;
    for (const StepContact& contact : made_.contacts)
      if (contact.pull > 0) add_impulse(made_, contact, -contact.pull * contact.normal, made_.free);
  }

  /// All pairs of a cell: an image may be anywhere.
  void meet_images() {
    for (std::size_t i = 0; i < n_; ++i)
      for (std::size_t j = 0; j < i; ++j) meet(i, j);
  }

  /// Sort and sweep along the longest axis of the sample.
  void meet_grains() {
    Vec3 low = Vec3::Constant(INFINITY), high = -low;
    for (const Vec3& x : middle_) low = low.cwiseMin(x), high = high.cwiseMax(x);
    Eigen::Index axis = 0;
    if (n_ > 0) (high - low).maxCoeff(&axis);
    std::vector<double> reach(n_);
    std::vector<std::size_t> order(n_);
    for (std::size_t k = 0; k < n_; ++k) {
      order[k] = k;
      reach[k] = in_.before.radius[k] + numbers_.alert + numbers_.h * in_.before.u[k].norm();
    }
    const auto begin = [&](std::size_t k) { return middle_[k][axis] - reach[k]; };
    std::ranges::sort(order, [&](std::size_t a, std::size_t b) { return begin(a) < begin(b); });
    for (std::size_t a = 0; a < n_; ++a)
      for (std::size_t b = a + 1; b < n_ && begin(order[b]) <= middle_[order[a]][axis] + reach[order[a]];
           ++b) {
        const auto [j, i] = std::minmax(order[a], order[b]);
        if ((middle_[i] - middle_[j]).cwiseAbs().maxCoeff() <= reach[i] + reach[j]) meet(i, j);
      }
  }

  void meet_walls() {
    for (std::size_t w = 0; w < in_.walls.size(); ++w) {
      const StepWall wall(in_.walls[w], in_.before.time, numbers_.h);
      if (!wall.there()) continue;
      const Placement middle = wall.placed(numbers_.h / 2);
      for (std::size_t i = 0; i < n_; ++i) meet_wall(wall, w, middle, i);
    }
  }

  void meet_wall(const StepWall& wall, std::size_t w, const Placement& middle, std::size_t i) {
    const PairLaw& pair = law(material_[i], in_.walls[w].material);
    const double radius = in_.before.radius[i];
    const Holding held = holding(pair, radius, INFINITY);
    // Of the whole step: free velocities of the problem are the mean ones of an impact.
    const Vec3 gained =
        numbers_.h * (in_.stage.gravity - in_.loads[w] * in_.walls[w].inv_mass() * in_.walls[w].normal);
    const Vec3 apart = in_.before.u[i] - (wall.moves() ? Vec3(Vec3::Zero()) : in_.walls[w].velocity);
    const double speed = apart.norm() + gained.norm() + wall.speed_near(middle_[i], radius);
    for (const WallTouch& touch :
         wall.touches(middle_[i], radius + numbers_.alert + numbers_.h * speed, middle)) {
      const Vec3 point = middle_[i] - radius * touch.normal;
      Vec3 drift = wall.material_velocity(point, touch.normal);
      const double gap = touch.distance - radius, v_n = touch.normal.dot(apart - drift);
      const bool closed = closed_in_run(gap, i, -1 - static_cast<std::int64_t>(w));
      double bias = 0;
      if (!meets(numbers_, {gap, v_n, v_n + touch.normal.dot(gained), closed}, pair.restitution, held.reach,
                 bias))
        continue;
      if (wall.moves()) made_.drive_speed = std::max(made_.drive_speed, drift.norm());
      // In a cell the material of a wall goes with the flow, in its plane.
      drift += (made_.cell.before + made_.cell.gain) * (middle_[i] - made_.cell.low);
      made_.contacts.push_back({i, -1 - static_cast<std::ptrdiff_t>(w), touch.normal, bias, pair.friction,
                                drift, Vec3::Zero(), gap <= held.reach ? acts_ * held.force : 0});
    }
  }

  const StepInput& in_;
  std::size_t n_;
  GapNumbers numbers_{};
  double acts_ = 0;  ///< StepProblem::time_step
  StepProblem made_;
  std::vector<Vec3> middle_;
  std::vector<Material> material_;
  std::set<std::array<std::int64_t, 2>> carry_;  ///< pairs of StepInput::after
};

}  // namespace

bool StepProblem::smooth() const {
  return std::ranges::all_of(contacts, [](const StepContact& contact) { return contact.friction == 0; });
}

void demand_audited(const Setup& setup) {
  const auto refuse = [](const std::string& what) {
    throw std::invalid_argument("the audit knows " + what + "; give it other scenes");
  };
  if (!setup.clumps.empty()) refuse("spheres only, no clumps");
  if (!setup.inserts.empty() || !setup.removes.empty()) refuse("no grains that are inserted or removed");
  for (const Wall& wall : setup.walls)
    if (!knows_shape(wall.shape.name)) refuse("no wall like '" + wall.name + "', a " + wall.shape.name);
  for (const Stage& stage : setup.stages)
    if (stage.laws.largest(&PairLaw::rolling_resistance) > 0) refuse("no rolling resistance");
}

StepProblem rebuild_step(const StepInput& input) {
  demand_audited(input.setup);
  return Builder(input).build();
}

void add_impulse(const StepProblem& problem, const StepContact& contact, const Vec3& r, Motion& motion) {
  const Vec3 turn = contact.normal.cross(r);
  motion.u[contact.first] += r / problem.mass[contact.first];
  motion.w[contact.first] -= problem.spin_mobility[contact.first] * turn;
  if (contact.at_wall()) {
    const std::size_t w = contact.wall();
    const Vec3& n = problem.wall_normal[w];
    motion.walls[w] -= problem.wall_inv_mass[w] * r.dot(n) * n;
    return;
  }
  motion.u[contact.other()] -= r / problem.mass[contact.other()];
  motion.w[contact.other()] -= problem.spin_mobility[contact.other()] * turn;
  if (problem.cell.follows())
    motion.cell += problem.cell.mobility.cwiseProduct(push_on_cell(r, contact.branch));
}

Motion motion_under(const StepProblem& problem, std::span<const Vec3> impulses) {
  Motion motion = problem.free;
  for (std::size_t c = 0; c < impulses.size(); ++c)
    add_impulse(problem, problem.contacts[c], impulses[c], motion);
  return motion;
}

Vec3 relative_velocity(const StepContact& contact, const Motion& motion) {
  const std::size_t i = contact.first;
  if (contact.at_wall())
    return motion.u[i] - motion.walls[contact.wall()] - motion.w[i].cross(contact.normal) - contact.drift;
  const std::size_t j = contact.other();
  return motion.u[i] - motion.u[j] - (motion.w[i] + motion.w[j]).cross(contact.normal) - contact.drift +
         stretched(motion.cell, contact.branch);
}

double speed_of_bodies(const StepProblem& problem, const StepContact& contact) {
  const Motion& free = problem.free;
  const double other = contact.at_wall() ? free.walls[contact.wall()].norm() + contact.drift.norm()
                                         : free.u[contact.other()].norm();
  return free.u[contact.first].norm() + other;
}

namespace {

/// A contact of a frame: what acts on the first of two ids, with the normal from the second to it.
struct FrameContact {
  Vec3 normal, impulse;
  bool known;
};

}  // namespace

RunImpulses impulses_of(const StepProblem& problem, const Frame& after) {
  std::map<std::array<std::int64_t, 2>, std::vector<FrameContact>> found;
  for (std::size_t k = 0; k < after.contact_bodies.size(); ++k) {
    auto [a, b] = after.contact_bodies[k];
    const bool turned = b >= 0 && a < b;
    if (turned) std::swap(a, b);
    const double sign = turned ? -1 : 1;
    found[{a, b}].push_back(
        {sign * after.contact_normal[k], sign * problem.time_step * after.contact_force[k], false});
  }
  RunImpulses all;
  for (const StepContact& contact : problem.contacts) {
    std::int64_t a = after.id[contact.first],
                 b = contact.at_wall() ? contact.second : after.id[contact.other()];
    const bool turned = !contact.at_wall() && a < b;
    if (turned) std::swap(a, b);
    const double sign = turned ? -1 : 1;
    all.r.push_back(contact.pull * contact.normal);
    for (FrameContact& entry : found[{a, b}]) {
      if (entry.known || !(entry.normal.dot(sign * contact.normal) > 1 - one_normal)) continue;
      all.r.back() = sign * entry.impulse + contact.pull * contact.normal;
      entry.known = true;
      break;
    }
  }
  for (const auto& [ids, entries] : found)
    all.unknown += static_cast<std::size_t>(std::ranges::count(entries, false, &FrameContact::known));
  return all;
}

}  // namespace talus::audit
