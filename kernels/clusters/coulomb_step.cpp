#include "kernels/clusters/coulomb_step.hpp"

#include <algorithm>
#include <cmath>

#include "kernels/bodies/larger.hpp"
#include "kernels/clusters/motion_norms.hpp"
#include "kernels/clusters/rolling_contacts.hpp"
#include "kernels/global/natural_map.hpp"
#include "kernels/global/stiffness.hpp"

namespace talus {

namespace {

/// H^T d of the columns H of a contact.
Vec3 seen_by(const Freedoms::Column& blocks, const ContactColumns& H, const Eigen::VectorXd& d) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t b = 0; b < H.size(); ++b)
    sum += H[b].topRows(blocks[b].count).transpose() * d.segment(blocks[b].begin, blocks[b].count);
  return sum;
}

}  // namespace

CoulombStep::CoulombStep(const BodyProblem& problem)
    : problem_(problem), freedoms_(problem), mass_(freedoms_.masses()) {
  const std::vector<Twist> V = velocities_of(problem, problem.impulse);
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    velocity_.push_back(constrained_velocity(problem.contacts[k], V));
    rate_.push_back(rolls(problem, k) ? rolling_rate_at(problem, k, V) : Vec3(Vec3::Zero()));
    add_columns(k);
  }
}

/// And the masses that a contact feels along its normal and across it, 1/W_nn and 1/W_tt.
void CoulombStep::add_columns(std::size_t k) {
  const ContactEquation& c = problem_.contacts[k];
  Columns columns;
  for (auto& turns : columns.turns) turns.setZero();
  columns.rolls = rolls(problem_, k);
  Mat3 W = Mat3::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    const Freedoms::Column column = freedoms_.column(c, Vec3(Vec3::Unit(axis)));
    if (axis == 0) columns.blocks = column;
    for (std::size_t b = 0; b < column.size(); ++b) columns.H[b].col(axis) = column[b].value;
    if (!columns.rolls) continue;
    const Freedoms::Column turn = freedoms_.column_of_moment(k, Vec3(Vec3::Unit(axis)));
    for (std::size_t b = 0; b < turn.size(); ++b) columns.turns[b].col(axis) = turn[b].value;
  }
  for (std::size_t b = 0; b < columns.H.size(); ++b)
    for (Eigen::Index i = 0; i < columns.blocks[b].count; ++i)
      W += columns.H[b].row(i).transpose() * columns.H[b].row(i) / mass_[columns.blocks[b].begin + i];
  const double W_nn = c.normal.dot(W * c.normal);
  normal_.push_back(1 / W_nn);
  tangential_.push_back(c.mu > 0 ? 2 / (W.trace() - W_nn) : 1 / W_nn);
  columns_.push_back(columns);
}

/// v + b n [m/s].
Vec3 CoulombStep::velocity(std::size_t k, const Vector& d) const {
  return velocity_[k] + constrained(problem_.contacts[k], change(k, d));
}

/// Of rolling [rad/s].
Vec3 CoulombStep::rate(std::size_t k, const Vector& d) const {
  return rate_[k] + tangential(problem_.contacts[k], turning(k, d));
}

double CoulombStep::wrong(std::size_t k, const Vector& d, const Carried& carried) const {
  const NaturalMap map = natural_map_of(problem_, problem_.contacts[k], carried.r, velocity(k, d));
  const double force = (carried.r - map.carried).norm();
  if (!columns_[k].rolls) return force;
  const Rolling contact = rolling_at(problem_, k, rate(k, d), carried.r);
  return force + wrong_moment(problem_, k, carried.m, contact);
}

Vec3 CoulombStep::force(std::size_t k, const Vector& d, const CoulombStart& start, Mat3* slope) const {
  const ContactEquation& c = problem_.contacts[k];
  const Mat3 along = c.normal * c.normal.transpose();
  const Mat3 rho = start.firmness * (normal_[k] * along + tangential_[k] * (Mat3::Identity() - along));
  const Vec3 z = start.t[k].r - rho * velocity(k, d), side = tangential(c, z);
  const double z_n = c.normal.dot(z), most = c.mu * z_n, length = side.norm();
  if (slope != nullptr) slope->setZero();
  if (!(z_n > 0)) return Vec3::Zero();
  if (c.mu > 0 && length <= most) {
    if (slope != nullptr) *slope = rho;
    return z;
  }
  const Vec3 direction = c.mu > 0 ? Vec3(side / length) : Vec3(Vec3::Zero());
  if (slope != nullptr) {
    *slope = along + c.mu * direction * c.normal.transpose();
    if (c.mu > 0) *slope += most / length * (Mat3::Identity() - along - direction * direction.transpose());
    *slope = (*slope * rho).eval();
  }
  return z_n * c.normal + most * direction;
}

/// With P' rho, where asked for.
Carried CoulombStep::evaluate(std::size_t k, const Vector& d, const CoulombStart& start, Slope* slope) const {
  Carried result{force(k, d, start, slope != nullptr ? &slope->force : nullptr)};
  if (!columns_[k].rolls) return result;
  const Rolling contact = rolling_at(problem_, k, rate(k, d), result.r);
  const double rho = start.firmness / contact.mobility;
  const Vec3 z = start.t[k].m - rho * contact.rate;
  result.m = admissible_moment(z, contact.most);
  if (slope == nullptr || contact.most == 0) return result;
  const Vec3& n = problem_.contacts[k].normal;
  const Mat3 tangent = Mat3::Identity() - n * n.transpose();
  const double length = z.norm();
  if (length <= contact.most) {
    slope->moment = rho * tangent;
    return result;
  }
  const Vec3 direction = z / length;
  slope->moment_by_force = problem_.rolling[k].arm * direction * (n.transpose() * slope->force);
  slope->moment = contact.most / length * rho * (tangent - direction * direction.transpose());
  return result;
}

Carried CoulombStep::carried(std::size_t k, const Vector& d, const CoulombStart& start) const {
  return evaluate(k, d, start, nullptr);
}

CoulombStep::Vector CoulombStep::residual(const Vector& d, const CoulombStart& start) const {
  Vector f = mass_.cwiseProduct(d);
  for (std::size_t k = 0; k < columns_.size(); ++k) {
    const Carried now = carried(k, d, start);
    const Vec3 moment = columns_[k].rolls ? Vec3(problem_.rolling[k].moment - now.m) : Vec3(Vec3::Zero());
    add_force(k, {problem_.impulse[k] - now.r, moment}, f);
  }
  return f;
}

bool CoulombStep::way(const Vector& d, const Vector& f, const CoulombStart& start, Vector& way,
                      double& work) const {
  const std::vector<Slope> slope = slopes(d, start);
  const BlockElimination system = eliminated(slope, work);
  way = system.solve(-f);
  way -= system.solve(f + product(slope, way));
  return way.allFinite();
}

LinearRest CoulombStep::linear_rest(const Vector& d, const CoulombStart& start, double firm_enough,
                                    double& work) const {
  const double times = firm_enough / start.firmness;
  std::vector<Slope> slope = slopes(d, start);
  for (Slope& s : slope) s.force *= times, s.moment_by_force *= times, s.moment *= times;
  const BlockElimination system = eliminated(slope, work);
  Vector f = -residual(d, start);
  std::vector<Carried> now;
  for (std::size_t k = 0; k < columns_.size(); ++k) {
    now.push_back(carried(k, d, start));
    add_force(k, {times * (now[k].r - start.t[k].r), times * (now[k].m - start.t[k].m)}, f);
  }
  Vector rest = system.solve(f);
  rest -= system.solve(product(slope, rest) - f);
  if (!rest.allFinite()) return {};
  double most = 0, largest = 0;
  for (std::size_t k = 0; k < columns_.size(); ++k) {
    most = larger(most, (times * (now[k].r - start.t[k].r) - asked(k, slope[k], rest).r).norm());
    largest = larger(largest, now[k].r.norm());
  }
  return {momentum_of(problem_, twists(rest)), most > 0 ? most / largest : 0};
}

/// P' rho of all contacts.
std::vector<CoulombStep::Slope> CoulombStep::slopes(const Vector& d, const CoulombStart& start) const {
  std::vector<Slope> slope(columns_.size());
  for (std::size_t k = 0; k < columns_.size(); ++k) evaluate(k, d, start, &slope[k]);
  return slope;
}

/// M + H S H^T, factorised.
BlockElimination CoulombStep::eliminated(const std::vector<Slope>& slope, double& work) const {
  std::vector<BlockElimination::Pair> pairs;
  for (std::size_t k = 0; k < columns_.size(); ++k) {
    if (slope[k].force.isZero(0)) continue;
    const Freedoms::Column& blocks = columns_[k].blocks;
    Freedoms::each_two(blocks, [&](std::size_t a, std::size_t b) {
      if (a < b) pairs.push_back({blocks[a].block, blocks[b].block});
    });
  }
  BlockElimination system(freedoms_, mass_, pairs);
  for (std::size_t k = 0; k < columns_.size(); ++k)
    if (!slope[k].force.isZero(0)) add_blocks(k, slope[k], system);
  system.factorise();
  work -= system.work();
  return system;
}

/// H S H^T of a contact. One that carries nothing has no moment either.
void CoulombStep::add_blocks(std::size_t k, const Slope& slope, BlockElimination& system) const {
  const Columns& of = columns_[k];
  Freedoms::each_two(of.blocks, [&](std::size_t a, std::size_t b) {
    const auto one = of.blocks[a].block, other = of.blocks[b].block;
    if (!of.rolls) return system.add(one, other, of.H[a] * slope.force * of.H[b].transpose());
    system.add(one, other,
               (of.H[a] * slope.force + of.turns[a] * slope.moment_by_force) * of.H[b].transpose() +
                   of.turns[a] * slope.moment * of.turns[b].transpose());
  });
}

/// f += H r of a contact.
void CoulombStep::add_force(std::size_t k, const Carried& carried, Vector& f) const {
  const auto& [blocks, H, rolls, turns] = columns_[k];
  for (std::size_t b = 0; b < H.size(); ++b) {
    f.segment(blocks[b].begin, blocks[b].count) += H[b].topRows(blocks[b].count) * carried.r;
    if (rolls) f.segment(blocks[b].begin, blocks[b].count) += turns[b].topRows(blocks[b].count) * carried.m;
  }
}

/// S H^T d of a contact.
Carried CoulombStep::asked(std::size_t k, const Slope& slope, const Vector& d) const {
  const Vec3 by = change(k, d);
  if (!columns_[k].rolls) return {slope.force * by};
  return {slope.force * by, slope.moment_by_force * by + slope.moment * turning(k, d)};
}

/// M x + sum of H S H^T x.
CoulombStep::Vector CoulombStep::product(const std::vector<Slope>& slope, const Vector& x) const {
  Vector y = mass_.cwiseProduct(x);
  for (std::size_t k = 0; k < columns_.size(); ++k) add_force(k, asked(k, slope[k], x), y);
  return y;
}

/// H^T d of a contact.
Vec3 CoulombStep::change(std::size_t k, const Vector& d) const {
  return seen_by(columns_[k].blocks, columns_[k].H, d);
}

/// The same of its moment [rad/s].
Vec3 CoulombStep::turning(std::size_t k, const Vector& d) const {
  return seen_by(columns_[k].blocks, columns_[k].turns, d);
}

}  // namespace talus
