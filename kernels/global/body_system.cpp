#include "kernels/global/body_system.hpp"

#include <Eigen/Cholesky>
#include <utility>

#include "kernels/bodies/index.hpp"

namespace talus {

/// rho H_i H_i^T of one contact of spheres, m = +-n.
void BodySystem::add_own_block(const Vec3& m, double rho, std::int32_t kind, Matrix6& block) {
  if (kind == slick) {
    block.topLeftCorner<3, 3>() += rho * m * m.transpose();
    return;
  }
  const Eigen::Matrix3d N = cross_matrix(m);
  block.diagonal().head<3>().array() += rho;
  block.topRightCorner<3, 3>() += rho * N;
  block.bottomLeftCorner<3, 3>() -= rho * N;
  block.bottomRightCorner<3, 3>() -= rho * N * N;
}

/// The same of blocks, for both bodies.
void BodySystem::add_block_of_blocks(const ContactEquation& contact, double rho) {
  const auto add = [&](std::int32_t body, const Mat3& lever) {
    Eigen::Matrix<double, 3, 6> motion;
    motion << Mat3::Identity(), lever;
    if (contact.mu > 0)
      diagonal_[at(body)] += rho * motion.transpose() * motion;
    else
      diagonal_[at(body)] +=
          rho * (motion.transpose() * contact.normal) * (contact.normal.transpose() * motion);
  };
  add(contact.first, contact.levers->first);
  if (contact.second >= 0) add(contact.second, contact.levers->second);
}

/// The same for the cell that a contact pushes.
void BodySystem::add_block_of_cell(const ContactEquation& contact, double rho) {
  touched_[at(contact.cell)] = 1;
  const Vec3& b = contact.branch;
  Eigen::Matrix<double, 3, 6> motion;
  motion << b[0], 0, 0, b[1], b[2], 0, 0, b[1], 0, 0, 0, b[2], 0, 0, b[2], 0, 0, 0;
  if (contact.mu == 0) motion = (contact.normal * (contact.normal.transpose() * motion)).eval();
  diagonal_[at(contact.cell)] += rho * motion.transpose() * motion;
}

/// f less the row's part from the other body.
inline void BodySystem::take(const Edge& edge, std::span<const Twist> x, Twist& f) const {
  if (edge.kind >= 0) return take_from_block(edge, x, f);
  const Twist& other = x[at(edge.other)];
  Vec3 v = edge.m.cross(other.w) - other.u;
  if (edge.kind == slick) v = edge.m.dot(v) * edge.m;
  v *= -edge.rho;
  f.u += v;
  f.w -= edge.m.cross(v);
}

void BodySystem::take_from_block(const Edge& edge, std::span<const Twist> x, Twist& f) const {
  const ContactEquation& contact = problem_.contacts[at(edge.kind / 2)];
  const bool is_first = edge.kind % 2 == 0;
  const Mat3& own = is_first ? contact.levers->first : contact.levers->second;
  const Mat3& others = is_first ? contact.levers->second : contact.levers->first;
  const Twist& other = x[at(edge.other)];
  Vec3 v = -other.u - others * other.w;
  if (contact.mu == 0) v = edge.m.dot(v) * edge.m;
  v *= -edge.rho;
  f.u += v;
  f.w += own.transpose() * v;
}

void BodySystem::take_ties(std::span<const Twist> x, std::span<Twist> f) const {
  for (const std::uint32_t tie : ties_) {
    const Link& link = links_[tie];
    const std::int32_t back = link.kind < 0 ? link.kind : link.kind + 1;
    take({link.normal, link.rho, link.second, link.kind}, x, f[at(link.first)]);
    take({-link.normal, link.rho, link.first, back}, x, f[at(link.second)]);
  }
}

BodySystem::BodySystem(const BodyProblem& problem, std::span<const double> rho)
    : problem_(problem),
      begin_(problem.bodies.size() + 1, 0),
      middle_(problem.bodies.size(), 0),
      touched_(problem.bodies.size(), 0),
      diagonal_(problem.bodies.size(), Matrix6::Zero()) {
  inertia_.reserve(problem.bodies.size());
  for (std::size_t b = 0; b < problem.bodies.size(); ++b) {
    const BodyUnknown& body = problem.bodies[b];
    inertia_.push_back(problem.counted(b) ? Inertia{body.mass, body.spin_mass} : Inertia{0, 0});
  }
  const auto row = [&](std::int32_t body) { return at(body) < problem.grains && problem.counted(at(body)); };
  links_.reserve(problem.contacts.size());
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const ContactEquation& c = problem.contacts[k];
    const auto link = static_cast<std::uint32_t>(k);
    const std::int32_t kind = c.levers != nullptr ? static_cast<std::int32_t>(2 * k)
                              : c.mu == 0         ? slick
                                                  : rough;
    touched_[at(c.first)] = 1;
    if (c.second >= 0) touched_[at(c.second)] = 1;
    links_.push_back({c.normal, rho[k], c.first, c.second, kind});
    if (c.levers != nullptr)
      add_block_of_blocks(c, rho[k]);
    else
      add_own_block(c.normal, rho[k], kind, diagonal_[at(c.first)]);
    if (c.cell >= 0) add_block_of_cell(c, rho[k]);
    if (c.second < 0) continue;
    if (c.levers == nullptr) add_own_block(-c.normal, rho[k], kind, diagonal_[at(c.second)]);
    if (row(c.first) && row(c.second)) {
      ++begin_[at(c.first) + 1];
      ++begin_[at(c.second) + 1];
    } else {
      ties_.push_back(link);
    }
  }
  for (std::size_t b = 0; b < size(); ++b) begin_[b + 1] += begin_[b];
  edges_.resize(begin_.back());
  // Lower unknowns first, in order of contact: two passes.
  std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
  for (const bool lower : {true, false}) {
    for (const Link& link : links_) {
      const auto [n, weight, first, second, kind] = link;
      const std::int32_t back = kind < 0 ? kind : kind + 1;
      if (second < 0 || !row(first) || !row(second)) continue;
      if ((second < first) == lower) edges_[next[at(first)]++] = {n, weight, second, kind};
      if ((first < second) == lower) edges_[next[at(second)]++] = {-n, weight, first, back};
    }
    if (lower) middle_ = next;
  }
}

void BodySystem::close() {
  for (std::size_t b = 0; b < size(); ++b) {
    // A trace other than 0 shows contacts of the body in some part. It is 0 or NaN where weights are too
    // small or are no numbers.
    if (diagonal_[b].trace() != 0) touched_[b] = 1;
    Matrix6 inverse = Matrix6::Zero();
    if (!problem_.counted(b)) {
      diagonal_[b] = inverse;
      continue;
    }
    const BodyUnknown& body = problem_.bodies[b];
    if (body.kind == BodyKind::cell) {
      Matrix6 block = diagonal_[b];
      block.diagonal().array() += body.mass;
      Eigen::Matrix<double, 6, 1> free;
      free << body.axis, body.shears;
      block = free.asDiagonal() * block * free.asDiagonal();
      block.diagonal() += Eigen::Matrix<double, 6, 1>(Eigen::Matrix<double, 6, 1>::Ones() - free);
      inverse = free.asDiagonal() * block.llt().solve(Matrix6::Identity()) * free.asDiagonal();
    } else if (body.kind == BodyKind::wall) {
      const double stiffness = body.mass + body.axis.dot(diagonal_[b].topLeftCorner<3, 3>() * body.axis);
      inverse.topLeftCorner<3, 3>() = body.axis * body.axis.transpose() / stiffness;
    } else if (body.spin_mass == 0) {
      Eigen::Matrix3d block = diagonal_[b].topLeftCorner<3, 3>();
      block.diagonal().array() += body.mass;
      inverse.topLeftCorner<3, 3>() = block.llt().solve(Eigen::Matrix3d::Identity());
    } else {
      Matrix6 block = diagonal_[b];
      block.diagonal().head<3>().array() += body.mass;
      block.diagonal().tail<3>().array() += body.spin_mass;
      inverse = block.llt().solve(Matrix6::Identity());
    }
    diagonal_[b] = 0.5 * (inverse + inverse.transpose());
  }
  // In place: two such arrays would be the most that ADMM ever holds.
  inverse_ = std::move(diagonal_);
}

namespace {

inline Twist times(const Eigen::Matrix<double, 6, 6>& A, const Twist& x) {
  Eigen::Matrix<double, 6, 1> v;
  v << x.u, x.w;
  v = A * v;
  return {v.head<3>(), v.tail<3>()};
}

}  // namespace

void BodySystem::restrict_all(std::span<Twist> f) const {
  for (std::size_t b = 0; b < problem_.grains; ++b)
    if (inertia_[b].spin_mass == 0) restrict_to_freedoms(problem_.bodies[b], f[b]);
  for (std::size_t b = problem_.grains; b < size(); ++b) restrict_to_freedoms(problem_.bodies[b], f[b]);
}

void BodySystem::multiply(std::span<const Twist> x, std::span<Twist> y) const {
  for (std::size_t b = 0; b < size(); ++b) y[b] = {inertia_[b].mass * x[b].u, inertia_[b].spin_mass * x[b].w};
  for (const Link& link : links_) {
    if (link.kind >= 0) {
      const ContactEquation& contact = problem_.contacts[at(link.kind / 2)];
      add_force(contact, link.rho * constrained(contact, relative_velocity(contact, x)), y);
      continue;
    }
    Vec3 v = relative_velocity_of_spheres(link, x);
    if (link.kind == slick) v = link.normal.dot(v) * link.normal;
    add_force_of_spheres(link, link.rho * v, y);
  }
  if (problem_.has_cell()) multiply_with_cell(x, y);
  restrict_all(y);
}

/// What the cell adds to the product: in each contact v gains U b/d.
void BodySystem::multiply_with_cell(std::span<const Twist> x, std::span<Twist> y) const {
  for (std::size_t k = 0; k < problem_.contacts.size(); ++k) {
    const ContactEquation& c = problem_.contacts[k];
    const double rho = links_[k].rho;
    const Vec3 of_cell = constrained(c, velocity_of_cell(c, x)),
               of_bodies = constrained(c, relative_velocity_of_spheres(c, x));
    add_force_of_spheres(c, rho * of_cell, y);
    add_force_on_cell(c, rho * (of_bodies + of_cell), y);
  }
}

void BodySystem::smooth_forward(std::span<const Twist> f, std::span<Twist> x) const {
  for (std::size_t b = 0; b < size(); ++b) {
    x[b] = Twist{};
    if (!problem_.counted(b)) continue;
    Twist sum = f[b];
    for (std::size_t e = begin_[b]; e < middle_[b]; ++e) take(edges_[e], x, sum);
    x[b] = times(inverse_[b], sum);
  }
}

// f - (D + L + U + T) x = -(U + T) x.
void BodySystem::rest_of_forward(std::span<const Twist> x, std::span<Twist> rest) const {
  for (std::size_t b = 0; b < size(); ++b) {
    Twist sum;
    for (std::size_t e = middle_[b]; e < begin_[b + 1]; ++e) take(edges_[e], x, sum);
    rest[b] = sum;
  }
  take_ties(x, rest);
  restrict_all(rest);
}

void BodySystem::take_ties(std::span<const Twist> f, std::span<const Twist> x, std::span<Twist> rest) const {
  for (std::size_t b = 0; b < size(); ++b) rest[b] = problem_.counted(b) ? f[b] : Twist{};
  take_ties(x, rest);
}

void BodySystem::smooth_backward(std::span<const Twist> rest, std::span<Twist> x) const {
  for (std::size_t b = size(); b-- > 0;) {
    if (!problem_.counted(b)) {
      x[b] = Twist{};
      continue;
    }
    Twist sum = rest[b];
    for (std::size_t e = begin_[b]; e < begin_[b + 1]; ++e) take(edges_[e], x, sum);
    x[b] = times(inverse_[b], sum);
  }
}

}  // namespace talus
