#pragma once

/// The contact problem of one step over bodies, each once: what solvers in body space see.
///
///   min 1/2 (V - V_free)^T M (V - V_free),   H^T V + b n + mu |v_t| n  in  K_mu*  at every contact
///
/// (docs/theory.md). Unknowns are the grains, 6 numbers each, then the walls of finite mass, 1 each along its
/// normal, and last a periodic cell that follows a stress, up to 6. Driven walls are data. With several
/// subdomains each holds a part of the problem (body_parts.hpp).

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/bodies/bodies.hpp"
#include "kernels/bodies/cell_velocity.hpp"
#include "kernels/bodies/motion.hpp"
#include "kernels/detection/chunks.hpp"
#include "kernels/detection/contacts.hpp"
#include "kernels/law/pair_table.hpp"

namespace talus {

/// Velocity u [m/s] and R omega [m/s] of a body; or momentum [N s] and its dual.
struct Twist {
  Vec3 u = Vec3::Zero();
  Vec3 w = Vec3::Zero();
};

inline double dot(const Twist& a, const Twist& b) {
  return a.u.dot(b.u) + a.w.dot(b.w);
}

/// What an unknown of a problem is; in this order they stand (BodyProblem::grains).
enum class BodyKind : std::uint8_t { grain, wall, cell };

/// One body. A wall never rotates and moves along `axis` only; its part of a Twist is (velocity x axis, 0). A
/// cell (kernels/bodies/cell_velocity.hpp) has u = (xx, yy, zz) and w = (xy, xz, yz), of which those move
/// whose entry of `axis`, and of `shears`, is 1; its `radius` is its edge over d.
struct BodyUnknown {
  double mass = 0;             ///< [kg] > 0
  double spin_mass = 0;        ///< I/R^2 [kg]; 0: does not turn
  Vec3 x = Vec3::Zero();       ///< centre [m]
  double radius = 0;           ///< [m]
  Vec3 axis = Vec3::Zero();    ///< of a wall: its normal, unit
  Vec3 shears = Vec3::Zero();  ///< of a cell
  BodyKind kind = BodyKind::grain;
  Twist free;  ///< velocity without contacts
};

/// One contact: v = u_first - u_second + n x (w_first + w_second) - drive, the second missing at a driven
/// wall. With levers v = u_first - u_second + B_first w_first - B_second w_second - drive. In a cell that
/// follows a stress v gains U b/d (cell_velocity.hpp).
struct ContactEquation {
  Vec3 normal = Vec3::Zero();  ///< unit, to the first body
  Vec3 offset = Vec3::Zero();  ///< b n - (velocity of the driven wall) [m/s]
  double mu = 0;
  std::int32_t first = -1;         ///< unknown
  std::int32_t second = -1;        ///< unknown; -1 at a driven wall
  std::int32_t place = -1;         ///< in `Contacts`
  std::int32_t wall = -1;          ///< number of the wall; -1 between bodies
  std::int32_t cell = -1;          ///< unknown; -1 where no cell follows a stress
  Vec3 branch = Vec3::Zero();      ///< b/d there
  double pull = 0;                 ///< of cohesion [N s]: r is beyond what the bodies feel by pull n
  double drive = 0;                ///< speed of the driven wall [m/s]; 0 between bodies
  const Levers* levers = nullptr;  ///< of a contact of blocks, in `Contacts`
};

/// What of a contact resists rolling (kernels/law/rolling_law.hpp).
struct RollingPart {
  double arm = 0;              ///< its moment is at most so much of the normal impulse [m]; 0: it has none
  Vec3 spin = Vec3::Zero();    ///< angular velocity of a turning wall's material [rad/s]
  Vec3 moment = Vec3::Zero();  ///< on the first body [N m s]
};

/// The whole problem, or the part of it that one subdomain holds: its contacts and the bodies that stand in
/// it, masses whole, and in every part all walls of finite mass.
struct BodyProblem {
  std::vector<BodyUnknown> bodies;
  std::vector<ContactEquation> contacts;
  std::vector<Vec3> impulse;  ///< r on the first body [N s], one per contact, shifted by cohesion
  std::vector<Twist> known;   ///< per unknown: sum over the contacts of this part of what they do to it
                              ///< besides r [N s]; empty where that is nothing
  /// Per contact; empty where none resists rolling. What the moments do is known, until a solver says that
  /// it changes them.
  std::vector<RollingPart> rolling;
  std::size_t grains = 0;            ///< unknowns before the first wall
  std::int32_t subdomain = 0;        ///< its number among all
  std::vector<char> counts;          ///< per unknown: of its copies this one counts; empty: all do
  std::vector<std::int32_t> shared;  ///< unknowns with copies in other parts, ascending

  bool counted(std::size_t body) const { return counts.empty() || counts[body] != 0; }
  /// A cell that follows a stress stands last, behind the walls.
  bool has_cell() const { return !bodies.empty() && bodies.back().kind == BodyKind::cell; }
  std::size_t walls() const { return bodies.size() - grains - (has_cell() ? 1 : 0); }  ///< of finite mass
};

/// Which unknowns of a problem or its part touch, and their masses; unknowns as there.
struct ContactGraph {
  std::vector<double> mass;                        ///< per unknown [kg]
  std::vector<std::array<std::int32_t, 2>> pairs;  ///< per contact its unknowns; second -1 at a driven wall
  std::int32_t cell = -1;  ///< unknown that all contacts push; -1: no cell follows a stress
  std::int32_t subdomain = 0;
  std::vector<char> counts;
  std::vector<std::int32_t> shared;

  bool counted(std::size_t body) const { return counts.empty() || counts[body] != 0; }
};
ContactGraph graph_of(const BodyProblem& problem);

/// A wall as the problem sees it; `inv_mass` [1/kg] is 0 when it is driven.
struct WallMotion {
  Vec3 normal;
  Vec3 free_velocity;  ///< [m/s]
  double inv_mass = 0;
};

/// A cell that follows a stress, as the problem sees it.
struct CellMotion {
  double mass = 0;                                       ///< [kg]; 0: there is none
  Vec3 stretches = Vec3::Zero(), shears = Vec3::Zero();  ///< 1 for the components that move
  double edge = 0;                                       ///< of the cell over d
  double driven = 0;  ///< fastest component of its flow that follows no stress [1/s]
};

/// The arrays of a step from which the problem is gathered.
struct BodyProblemSource {
  std::span<const Vec3> x;             ///< [m]
  std::span<const double> radius;      ///< [m]
  std::span<const Velocity> velocity;  ///< masses and spin mobilities; velocities are not read
  const FreeVelocity& free;
  std::span<const WallMotion> walls;
  const Chunks& chunks;
  const Contacts& contacts;
  const PairTable& laws;
  Multiplicities parts;  ///< of the slots: copies carry M/parts
  CellMotion cell = {};
};

/// The slots and chunks of one subdomain among those of a step.
struct BodyProblemPart {
  std::int32_t subdomain = 0;      ///< its number among all
  std::int32_t local = 0;          ///< the same as in Chunks
  std::size_t begin = 0, end = 0;  ///< its slots
  std::span<const char> counts;    ///< per slot of the step: of the body's copies this one counts
  std::span<const std::uint16_t> multiplicity;  ///< per slot of the step: in how many subdomains it stands
};

/// The graph of the problem gathered below, all of it or of one subdomain, without what only solvers read.
ContactGraph gather_graph(const BodyProblemSource& source);
ContactGraph gather_graph(const BodyProblemSource& source, const BodyProblemPart& part);

/// Gathers the problem, contacts in order of chunk, with the impulses that `contacts` hold. Unknowns are the
/// slots, then the walls.
BodyProblem gather_problem(const BodyProblemSource& source);

/// The same for one subdomain. Walls count in the first subdomain.
BodyProblem gather_problem(const BodyProblemSource& source, const BodyProblemPart& part);

/// Writes the impulses, and moments of those that resist rolling, back.
void scatter_impulses(const BodyProblem& problem, Contacts& contacts);

/// V = V_free + M^-1 H r, one entry per unknown, summed in order of contact.
std::vector<Twist> velocities_of(const BodyProblem& problem, std::span<const Vec3> impulse);

/// v - offset: the relative velocity at a contact before drives and bias. `c` is a ContactEquation, or has
/// its normal, first and second, of spheres.
template <class Contact>
Vec3 relative_velocity_of_spheres(const Contact& c, std::span<const Twist> V) {
  const Twist& a = V[static_cast<std::size_t>(c.first)];
  if (c.second < 0) return a.u + c.normal.cross(a.w);
  const Twist& b = V[static_cast<std::size_t>(c.second)];
  return a.u - b.u + c.normal.cross(a.w + b.w);
}
/// U b/d of the cell of a contact [m/s].
inline Vec3 velocity_of_cell(const ContactEquation& c, std::span<const Twist> V) {
  const auto& [u, w] = V[static_cast<std::size_t>(c.cell)];
  return velocity_at({u[0], u[1], u[2], w[0], w[1], w[2]}, c.branch);
}

inline Vec3 relative_velocity(const ContactEquation& c, std::span<const Twist> V) {
  const Vec3 flow = c.cell >= 0 ? velocity_of_cell(c, V) : Vec3(Vec3::Zero());
  if (c.levers == nullptr) return relative_velocity_of_spheres(c, V) + flow;
  const Twist& a = V[static_cast<std::size_t>(c.first)];
  const Vec3 v = a.u + c.levers->first * a.w + flow;
  if (c.second < 0) return v;
  const Twist& b = V[static_cast<std::size_t>(c.second)];
  return v - b.u - c.levers->second * b.w;
}

/// [n] with [n] w = n x w: the lever of a sphere's first body.
inline Mat3 cross_matrix(const Vec3& n) {
  Mat3 N;
  N << 0, -n[2], n[1], n[2], 0, -n[0], -n[1], n[0], 0;
  return N;
}

/// The part of a vector that a contact constrains: without friction the normal part.
inline Vec3 constrained(const ContactEquation& c, const Vec3& v) {
  return c.mu > 0 ? v : Vec3(c.normal.dot(v) * c.normal);
}

/// The velocity that the law of a contact speaks of [m/s]: the relative one, with bias and drive, as far as
/// the contact constrains it.
inline Vec3 constrained_velocity(const ContactEquation& c, std::span<const Twist> V) {
  return constrained(c, relative_velocity(c, V) + c.offset);
}

inline Vec3 tangential(const ContactEquation& c, const Vec3& v) {
  return v - c.normal.dot(v) * c.normal;
}

/// m |u|^2 + (I/R^2) |w|^2 [J].
inline double kinetic2(const BodyUnknown& body, const Vec3& u, const Vec3& w) {
  return body.mass * u.squaredNorm() + body.spin_mass * w.squaredNorm();
}

/// F += H r for one contact. Of a wall only the part along its axis is meant: see `restrict_to_freedoms`.
template <class Contact>
void add_force_of_spheres(const Contact& c, const Vec3& r, std::span<Twist> F) {
  Twist& a = F[static_cast<std::size_t>(c.first)];
  const Vec3 turn = c.normal.cross(r);
  a.u += r;
  a.w -= turn;
  if (c.second < 0) return;
  Twist& b = F[static_cast<std::size_t>(c.second)];
  b.u -= r;
  b.w -= turn;
}
/// The cell's part of F += H r, before `restrict_to_freedoms`.
inline void add_force_on_cell(const ContactEquation& c, const Vec3& r, std::span<Twist> F) {
  CellVelocity f{};
  add_impulse(r, c.branch, f);
  Twist& cell = F[static_cast<std::size_t>(c.cell)];
  cell.u += Vec3(f[0], f[1], f[2]);
  cell.w += Vec3(f[3], f[4], f[5]);
}

inline void add_force(const ContactEquation& c, const Vec3& r, std::span<Twist> F) {
  if (c.cell >= 0) add_force_on_cell(c, r, F);
  if (c.levers == nullptr) return add_force_of_spheres(c, r, F);
  Twist& a = F[static_cast<std::size_t>(c.first)];
  a.u += r;
  a.w += c.levers->first.transpose() * r;
  if (c.second < 0) return;
  Twist& b = F[static_cast<std::size_t>(c.second)];
  b.u -= r;
  b.w -= c.levers->second.transpose() * r;
}

/// Drops what cannot move a body: of walls all but the part along the axis, of bodies that do not turn w.
inline void restrict_to_freedoms(const BodyUnknown& body, Twist& f) {
  if (body.kind == BodyKind::cell) {
    f = {f.u.cwiseProduct(body.axis), f.w.cwiseProduct(body.shears)};
    return;
  }
  if (body.kind == BodyKind::wall) f.u = body.axis.dot(f.u) * body.axis;
  if (body.kind == BodyKind::wall || body.spin_mass == 0) f.w.setZero();
}

/// In place, from the sum of forces on a body: V = V_free + M^-1 F.
inline void velocity_from_force(const BodyUnknown& body, Twist& f) {
  restrict_to_freedoms(body, f);
  f.u = body.free.u + f.u / body.mass;
  f.w = body.spin_mass > 0 ? Vec3(body.free.w + f.w / body.spin_mass) : Vec3::Zero();
}

}  // namespace talus
