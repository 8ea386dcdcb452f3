#include "kernels/body_system.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

namespace talus {

namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;

std::size_t at(std::int32_t k) {
  return static_cast<std::size_t>(k);
}

Eigen::Matrix3d cross_matrix(const Vec3& n) {
  Eigen::Matrix3d N;
  N << 0, -n[2], n[1], n[2], 0, -n[0], -n[1], n[0], 0;
  return N;
}

/// rho H_i H_i^T of one contact.
Eigen::Matrix<double, 6, 6> own_block(const Vec3& m, double rho, bool slick) {
  Eigen::Matrix<double, 3, 6> transposed;
  transposed << Eigen::Matrix3d::Identity(), cross_matrix(m);
  if (slick) transposed = (m * (m.transpose() * transposed)).eval();
  return rho * transposed.transpose() * transposed;
}

void restrict_all(const BodyProblem& problem, std::span<Twist> f) {
  for (std::size_t b = 0; b < f.size(); ++b) restrict_to_freedoms(problem.bodies[b], f[b]);
}

}  // namespace

/// f less the row's part from the other body.
inline void BodySystem::take(const Edge& edge, const Twist& x, Twist& f) {
  Vec3 v = edge.m.cross(x.w) - x.u;
  if (edge.slick) v = edge.m.dot(v) * edge.m;
  v *= -edge.rho;
  f.u += v;
  f.w -= edge.m.cross(v);
}

void BodySystem::take_ties(std::span<const Twist> x, std::span<Twist> f) const {
  for (const Tie& tie : ties_) {
    const Edge back{-tie.edge.m, tie.edge.rho, tie.first, tie.edge.slick};
    take(tie.edge, x[at(tie.edge.other)], f[at(tie.first)]);
    take(back, x[at(tie.first)], f[at(tie.edge.other)]);
  }
}

BodySystem::BodySystem(const BodyProblem& problem, std::span<const double> rho)
    : problem_(problem),
      rho_(rho.begin(), rho.end()),
      begin_(problem.bodies.size() + 1, 0),
      middle_(problem.bodies.size(), 0),
      diagonal_(problem.bodies.size(), Matrix6::Zero()),
      inverse_(problem.bodies.size(), Matrix6::Zero()) {
  const auto& contacts = problem.contacts;
  const auto row = [&](std::int32_t body) { return at(body) < problem.grains && problem.counted(at(body)); };
  const auto edge = [&](const ContactEquation& c) { return c.second >= 0 && row(c.first) && row(c.second); };
  std::size_t ties = 0;
  for (const ContactEquation& c : contacts) {
    if (!edge(c)) {
      ties += c.second >= 0 ? 1 : 0;
      continue;
    }
    ++begin_[at(c.first) + 1];
    ++begin_[at(c.second) + 1];
  }
  for (std::size_t b = 0; b < size(); ++b) begin_[b + 1] += begin_[b];
  edges_.resize(begin_.back());
  ties_.reserve(ties);
  // Lower unknowns first, in order of contact: two passes.
  std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
  for (const bool lower : {true, false}) {
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      const ContactEquation& c = contacts[k];
      if (!edge(c)) continue;
      const std::int32_t slick = c.mu == 0 ? 1 : 0;
      if ((c.second < c.first) == lower) edges_[next[at(c.first)]++] = {c.normal, rho[k], c.second, slick};
      if ((c.first < c.second) == lower) edges_[next[at(c.second)]++] = {-c.normal, rho[k], c.first, slick};
    }
    if (lower) middle_ = next;
  }
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const ContactEquation& c = contacts[k];
    if (c.second >= 0 && !edge(c))
      ties_.push_back({{c.normal, rho[k], c.second, c.mu == 0 ? 1 : 0}, c.first});
    diagonal_[at(c.first)] += own_block(c.normal, rho[k], c.mu == 0);
    if (c.second >= 0) diagonal_[at(c.second)] += own_block(-c.normal, rho[k], c.mu == 0);
  }
}

void BodySystem::close() {
  for (std::size_t b = 0; b < size(); ++b) {
    touched_.push_back(diagonal_[b].trace() > 0 ? 1 : 0);
    if (!problem_.counted(b)) continue;
    const BodyUnknown& body = problem_.bodies[b];
    Matrix6 inverse = Matrix6::Zero();
    if (body.wall) {
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
    inverse_[b] = 0.5 * (inverse + inverse.transpose());
  }
  diagonal_ = {};
}

namespace {

inline Vector6 vector_of(const Twist& t) {
  Vector6 v;
  v << t.u, t.w;
  return v;
}

inline Twist times(const Eigen::Matrix<double, 6, 6>& A, const Twist& x) {
  const Vector6 v = A * vector_of(x);
  return {v.head<3>(), v.tail<3>()};
}

}  // namespace

void BodySystem::multiply(std::span<const Twist> x, std::span<Twist> y) const {
  for (std::size_t b = 0; b < size(); ++b) {
    const BodyUnknown& body = problem_.bodies[b];
    y[b] = problem_.counted(b) ? Twist{body.mass * x[b].u, body.spin_mass * x[b].w} : Twist{};
  }
  for (std::size_t k = 0; k < rho_.size(); ++k) {
    const ContactEquation& c = problem_.contacts[k];
    add_force(c, rho_[k] * constrained(c, relative_velocity(c, x)), y);
  }
  restrict_all(problem_, y);
}

void BodySystem::smooth_forward(std::span<const Twist> f, std::span<Twist> x) const {
  for (std::size_t b = 0; b < size(); ++b) {
    x[b] = Twist{};
    if (!problem_.counted(b)) continue;
    Twist sum = f[b];
    for (std::size_t e = begin_[b]; e < middle_[b]; ++e) take(edges_[e], x[at(edges_[e].other)], sum);
    x[b] = times(inverse_[b], sum);
  }
}

// f - (D + L + U + T) x = -(U + T) x.
void BodySystem::rest_of_forward(std::span<const Twist> x, std::span<Twist> rest) const {
  for (std::size_t b = 0; b < size(); ++b) {
    Twist sum;
    for (std::size_t e = middle_[b]; e < begin_[b + 1]; ++e) take(edges_[e], x[at(edges_[e].other)], sum);
    rest[b] = sum;
  }
  take_ties(x, rest);
  restrict_all(problem_, rest);
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
    for (std::size_t e = begin_[b]; e < begin_[b + 1]; ++e) take(edges_[e], x[at(edges_[e].other)], sum);
    x[b] = times(inverse_[b], sum);
  }
}

}  // namespace talus
