#include "apps/study_certificate/step_problem.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <stdexcept>
#include <unordered_map>
#include <vector>

#include "apps/study_certificate/step_gaps.hpp"
#include "apps/study_certificate/touch_shapes.hpp"

namespace talus::audit {

namespace {

/// Bodies that attract one another touch up to this gap, over the smaller radius.
constexpr double reach_of_cohesion = 1e-3;

/// Roundings of the largest coordinate that a gap may be of.
constexpr double roundings_of_gap = 4;

/// What rebuild_step works with.
class Builder {
 public:
  explicit Builder(const StepInput& input) : in_(input), n_(input.before.x.size()) {
    const double h = in_.stage.time_step;
    numbers_.h = h;
    numbers_.slow = 2 * h * in_.stage.gravity.norm();
    if (in_.setup.solver.restitution_law == RestitutionLaw::moreau)
      numbers_.E = in_.stage.laws.largest(&PairLaw::restitution);
    acts_ = h / (1 + numbers_.E);
    if (in_.after == nullptr) return;
    for (const auto& [a, b] : in_.after->contact_bodies) carry_.insert({a, b});
  }

  StepProblem build() {
    made_.time_step = acts_;
    made_.reflection = numbers_.E;
    made_.gravity = in_.stage.gravity;
    take_grains();
    numbers_.alert = in_.setup.detection.alert > 0 ? in_.setup.detection.alert : 0.1 * smallest_;
    numbers_.turning = 0.5 * smallest_;
    take_walls();
    take_cell();
    made_.cell.repeats ? meet_images() : meet_grains();
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
      made_.free.u.push_back(in_.before.u[k] + acts_ * in_.stage.gravity);
      middle_.push_back(in_.before.x[k] + numbers_.h / 2 * in_.before.u[k]);
      material_.push_back(in_.bodies.material.empty() ? material_of_grains : in_.bodies.material[s]);
      const Vec3 omega = in_.before.omega.empty() ? Vec3::Zero() : in_.before.omega[k];
      if (in_.bodies.shape.empty() || in_.bodies.shape[s] == 0) {
        made_.spin_mobility.push_back(turns ? 2.5 / m : 0);
        made_.free.w.push_back(R * omega);
        balls_.push_back({k, Vec3::Zero(), R});
        continue;
      }
      take_clump(k, sized(in_.setup.clumps[in_.bodies.shape[s] - std::size_t{1}], R), {{}, omega});
    }
    if (!made_.clumps.empty() && made_.clumps.size() != n_)
      throw std::invalid_argument("the audit knows grains of one shape; give it other scenes");
    for (const BallAt& ball : balls_) smallest_ = std::min(smallest_, ball.radius);
  }

  void take_clump(std::size_t k, const BallBody& body, ClumpTurn turn) {
    turn.orientation = in_.before.orientation[k];
    const TurnedClump& clump =
        made_.clumps.emplace_back(turned_half(body, made_.mass[k], in_.before.radius[k], turn, numbers_.h));
    made_.spin_mobility.push_back(in_.setup.rotation ? clump.spin_mobility : 0);
    made_.free.w.push_back(clump.w());
    for (const Ball& ball : clump.balls) balls_.push_back({k, ball.centre, ball.radius});
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

  /// Gaps that may be rounding [m].
  double rounding() const { return roundings_of_gap * made_.rounding_speed * numbers_.h; }

  /// StepInput::after, of a grain and another body: the other grain's id, or -1 - w of a wall.
  bool carries(std::size_t k, std::int64_t other) const {
    const std::int64_t id = in_.before.id[k];
    return carry_.contains({id, other}) || carry_.contains({other, id});
  }
  InRun in_run(double gap, std::size_t k, std::int64_t other) const {
    if (std::abs(gap) > rounding()) return InRun::gap_tells;
    return carries(k, other) ? InRun::carry : InRun::do_not;
  }

  /// A ball of a body, in the middle of the step; of a sphere it is the sphere.
  struct BallAt {
    std::size_t body;
    Vec3 place;  ///< from the centre of the body [m]
    double radius;
  };
  Vec3 centre(const BallAt& ball) const { return middle_[ball.body] + ball.place; }

  /// B = -[a]x S^-1 of a body at the arm a, omega being S^-1 w.
  Mat3 lever(std::size_t body, const Vec3& arm) const {
    const Mat3 turning = made_.clumps[body].lengths.inverse();
    Mat3 B;
    for (const Eigen::Index axis : {0, 1, 2}) B.col(axis) = turning.col(axis).cross(arm);
    return B;
  }

  /// Of clumps: the arms of both bodies to a point of contact [m] of a ball of the first.
  void give_levers(StepContact& contact, const BallAt& ball, const Vec3& point) const {
    if (made_.clumps.empty()) return;
    contact.ball = {ball.place, ball.radius};
    contact.levers.emplace();
    contact.levers->first = lever(contact.first, point - middle_[contact.first]);
    if (!contact.at_wall()) contact.levers->second = lever(contact.other(), point - middle_[contact.other()]);
  }

  /// Velocities before the step; those of turns are the free ones.
  Vec3 velocity_before(const StepContact& contact) const {
    const std::size_t i = contact.first;
    Vec3 v = in_.before.u[i];
    if (!contact.at_wall()) v -= in_.before.u[contact.other()];
    if (!contact.levers) return v;
    v += contact.levers->first * made_.free.w[i];
    if (!contact.at_wall()) v -= contact.levers->second * made_.free.w[contact.other()];
    return v;
  }

  void meet(const BallAt& one, const BallAt& other) {
    const std::size_t i = one.body, j = other.body;
    const StepCell& cell = made_.cell;
    const Vec3 apart = centre(one) - centre(other), k = cell.edges_between(apart),
               d = cell.repeats ? Vec3(apart - cell.edges * k) : apart;
    const double distance = d.norm(), apart_by = distance - one.radius - other.radius;
    const Vec3 normal = distance > 0 ? Vec3(d / distance) : Vec3(Vec3::UnitZ());
    const PairLaw& pair = law(material_[i], material_[j]);
    const Vec3 drift = (cell.before + cell.gain) * cell.edges * k;
    StepContact contact{i, static_cast<std::ptrdiff_t>(j), normal, 0, pair.friction, drift, d / cell.length};
    give_levers(contact, one, centre(one) - (one.radius + apart_by / 2) * normal);
    const Holding held = holding(pair, in_.before.radius[i], in_.before.radius[j]);
    const double reach = held.reach * std::min(one.radius, other.radius);
    const Vec3 way = numbers_.h * (centre_velocity(one) - centre_velocity(other) - cell.rates * k);
    const double v_n = normal.dot(velocity_before(contact) - cell.rates * k),
                 gap = gap_on_the_way(normal, apart_by, d,
                                      {way, reach, rounding(), carries(i, in_.before.id[j])});
    const InRun run = in_run(gap, i, in_.before.id[j]);
    if (!meets(numbers_, {gap, v_n, v_n, run}, pair.restitution, reach, contact.bias)) return;
    contact.pull = gap <= reach ? acts_ * held.force : 0;
    made_.contacts.push_back(contact);
    const double R = in_.before.radius[i], S = in_.before.radius[j];
    resist_rolling(contact, pair, {R * S / (R + S), Vec3::Zero()});
  }

  /// Of a contact: its reduced radius [m], and the angular velocity of a wall [rad/s].
  struct Rolled {
    double radius;
    Vec3 omega;
  };
  void resist_rolling(const StepContact& contact, const PairLaw& pair, const Rolled& rolled) {
    if (pair.rolling_resistance == 0 || pair.friction == 0) return;  // smooth contacts do not resist
    StepContact moment = contact;
    const Mat3 tangent = Mat3::Identity() - contact.normal * contact.normal.transpose();
    moment.rolls = rolled.radius;
    moment.friction = pair.rolling_resistance;
    moment.bias = moment.pull = 0;
    moment.branch = Vec3::Zero();
    moment.drift = rolled.radius * (tangent * rolled.omega);
    moment.levers.emplace();
    moment.levers->first = rolled.radius / in_.before.radius[contact.first] * tangent;
    if (!contact.at_wall())
      moment.levers->second = rolled.radius / in_.before.radius[contact.other()] * tangent;
    made_.contacts.push_back(moment);
  }

  /// How a pair is held together: by so much [N] up to that gap, over the smaller radius.
  struct Holding {
    double force = 0, reach = 0;
  };
  static Holding holding(const PairLaw& pair, double radius, double other) {
    const double force = pair.cohesion_of({radius, other});
    return {force, force > 0 ? reach_of_cohesion : 0};
  }

  /// Cohesion is a given force: it belongs to what happens without contacts.
  void pull_together() {
    made_.unpulled = made_.free;
    for (const StepContact& contact : made_.contacts)
      if (contact.pull > 0) add_impulse(made_, contact, -contact.pull * contact.normal, made_.free);
  }

  /// All pairs of a cell: an image may be anywhere.
  void meet_images() {
    for (std::size_t i = 0; i < balls_.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) meet(balls_[i], balls_[j]);
  }

  /// Of the centre of a ball, before the step [m/s].
  Vec3 centre_velocity(const BallAt& ball) const {
    if (made_.clumps.empty()) return in_.before.u[ball.body];
    return in_.before.u[ball.body] + lever(ball.body, ball.place) * made_.free.w[ball.body];
  }

  /// How far the surface of a ball comes in the step, along a line [m].
  double reach(const BallAt& ball) const {
    const double speed = in_.before.u[ball.body].norm() + speed_of_turn(ball);
    return ball.radius + numbers_.alert + numbers_.h * speed;
  }

  double speed_of_turn(const BallAt& ball) const {
    if (made_.clumps.empty() || in_.before.omega.empty()) return 0;
    return (ball.place.norm() + ball.radius) * in_.before.omega[ball.body].norm();
  }

  /// Sort and sweep along the longest axis of the sample.
  void meet_grains() {
    Vec3 low = Vec3::Constant(INFINITY), high = -low;
    for (const Vec3& x : middle_) low = low.cwiseMin(x), high = high.cwiseMax(x);
    Eigen::Index axis = 0;
    if (n_ > 0) (high - low).maxCoeff(&axis);
    std::vector<double> far;
    std::vector<std::size_t> order(balls_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    for (const BallAt& ball : balls_) far.push_back(reach(ball));
    const auto along = [&](std::size_t k) { return centre(balls_[k])[axis]; };
    const auto begin = [&](std::size_t k) { return along(k) - far[k]; };
    std::ranges::sort(order, [&](std::size_t a, std::size_t b) { return begin(a) < begin(b); });
    for (std::size_t a = 0; a < order.size(); ++a)
      for (std::size_t b = a + 1; b < order.size() && begin(order[b]) <= along(order[a]) + far[order[a]];
           ++b) {
        const auto [j, i] = std::minmax(order[a], order[b]);
        const BallAt &one = balls_[i], &other = balls_[j];
        if (one.body != other.body && (centre(one) - centre(other)).cwiseAbs().maxCoeff() <= far[i] + far[j])
          meet(one, other);
      }
  }

  void meet_walls() {
    for (const Wall& wall : in_.walls) {
      walls_.emplace_back(wall, in_.before.time, numbers_.h);
      placed_.push_back(walls_.back().placed(numbers_.h / 2));
    }
    for (std::size_t w = 0; w < walls_.size(); ++w)
      if (walls_[w].there())
        for (const BallAt& ball : balls_) meet_wall(walls_[w], w, ball);
  }

  void meet_wall(const StepWall& wall, std::size_t w, const BallAt& ball) {
    const std::size_t i = ball.body;
    const PairLaw& pair = law(material_[i], in_.walls[w].material);
    const Vec3 at = centre(ball);
    const Holding held = holding(pair, in_.before.radius[i], INFINITY);
    // Of the whole step: free velocities of the problem are the mean ones of an impact.
    const Vec3 gained =
        numbers_.h * (in_.stage.gravity - in_.loads[w] * in_.walls[w].inv_mass() * in_.walls[w].normal);
    const Vec3 of_wall = wall.moves() ? Vec3(Vec3::Zero()) : in_.walls[w].velocity;
    const double speed = (in_.before.u[i] - of_wall).norm() + speed_of_turn(ball) + gained.norm() +
                         wall.speed_near(at, ball.radius);
    const Vec3 before = centre_velocity(ball) - wall.velocity_at(at);
    const double reach = held.reach * ball.radius;
    const Way way{numbers_.h * before, numbers_.h * (before + gained), reach};
    for (const WallTouch& seen :
         wall.touches(at, ball.radius + numbers_.alert + numbers_.h * speed, placed_[w])) {
      const WallTouch touch = on_the_way(wall, placed_[w], at, ball.radius, way, seen);
      const Vec3 point = at - ball.radius * touch.normal;
      StepContact contact{i,
                          -1 - static_cast<std::ptrdiff_t>(w),
                          touch.normal,
                          0,
                          pair.friction,
                          wall.material_velocity(point, touch.normal, in_.before.u[i])};
      give_levers(contact, ball, point);
      const double gap = touch.distance - ball.radius,
                   v_n = touch.normal.dot(velocity_before(contact) - of_wall - contact.drift);
      const InRun run = in_run(gap, i, -1 - static_cast<std::int64_t>(w));
      if (!meets(numbers_, {gap, v_n, v_n + touch.normal.dot(gained), run}, pair.restitution, reach,
                 contact.bias) ||
          stands_on_another(walls_, placed_, w, at, ball.radius, seen))
        continue;
      if (wall.moves()) made_.drive_speed = std::max(made_.drive_speed, contact.drift.norm());
      // In a cell the material of a wall goes with the flow, in its plane.
      contact.drift += (made_.cell.before + made_.cell.gain) * (middle_[i] - made_.cell.low);
      contact.pull = gap <= reach ? acts_ * held.force : 0;
      made_.contacts.push_back(contact);
      resist_rolling(contact, pair, {in_.before.radius[i], wall.spin()});
    }
  }

  const StepInput& in_;
  std::vector<StepWall> walls_;
  std::vector<Placement> placed_;  ///< in the middle of the step
  std::size_t n_;
  GapNumbers numbers_{};
  double acts_ = 0;  ///< StepProblem::time_step
  StepProblem made_;
  std::vector<Vec3> middle_;
  std::vector<BallAt> balls_;   ///< of all bodies
  double smallest_ = INFINITY;  ///< of their radii [m]
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
  if (!setup.clumps.empty() && setup.domain.repeats) refuse("no clumps in a periodic cell");
  if (!setup.inserts.empty() || !setup.removes.empty()) refuse("no grains that are inserted or removed");
  for (const Wall& wall : setup.walls)
    if (!knows_shape(wall.shape.name)) refuse("no wall like '" + wall.name + "', a " + wall.shape.name);
  for (const Stage& stage : setup.stages)
    if (!setup.clumps.empty() && stage.laws.largest(&PairLaw::rolling_resistance) > 0)
      refuse("no rolling resistance of clumps");
}

StepProblem rebuild_step(const StepInput& input) {
  demand_audited(input.setup);
  return Builder(input).build();
}

}  // namespace talus::audit
