#include "kernels/clusters/contact_matrix.hpp"

#include <array>
#include <cmath>

#include "kernels/bodies/index.hpp"

namespace talus {

namespace {

/// What an impulse at a contact, in its frame, does to one of its bodies: M^-1/2 times the force on it. Two
/// contacts of a body are coupled by the product of theirs.
struct Arm {
  std::size_t contact;
  Mat3 shift, turn;
};

Arm arm_of(const BodyProblem& problem, std::size_t k, std::int32_t body, const Mat3& frame) {
  Arm arm{k, Mat3::Zero(), Mat3::Zero()};
  const BodyUnknown& b = problem.bodies[at(body)];
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::array<Twist, 2> force{};
    // The contact as if it stood alone, its bodies 0 and 1.
    ContactEquation c = problem.contacts[k];
    const bool first = c.first == body;
    c.first = 0;
    c.second = c.second < 0 ? -1 : 1;
    add_force(c, frame.col(axis), force);
    Twist& own = force[first ? 0 : 1];
    restrict_to_freedoms(b, own);
    arm.shift.col(axis) = own.u / std::sqrt(b.mass);
    if (b.spin_mass > 0) arm.turn.col(axis) = own.w / std::sqrt(b.spin_mass);
  }
  return arm;
}

}  // namespace

std::vector<Vec3> ContactMatrix::impulses() const {
  std::vector<Vec3> in_space;
  for (std::size_t k = 0; k < frames.size(); ++k)
    in_space.emplace_back(frames[k] * Eigen::Map<const Vec3>(&r[3 * k]));
  return in_space;
}

std::size_t blocks_of(const BodyProblem& problem) {
  std::vector<std::size_t> touching(problem.bodies.size(), 0);
  for (const ContactEquation& c : problem.contacts) {
    ++touching[at(c.first)];
    if (c.second >= 0) ++touching[at(c.second)];
  }
  std::size_t blocks = 0;
  for (const std::size_t n : touching)
    if (n > 0) blocks += n * (n - 1);
  return blocks;
}

ContactMatrix matrix_of(const BodyProblem& problem) {
  const std::size_t n = problem.contacts.size();
  ContactMatrix matrix;
  std::vector<double> q, mu;
  std::vector<std::vector<Arm>> arms(problem.bodies.size());
  const std::vector<Twist> free = velocities_of(problem, std::vector<Vec3>(n, Vec3::Zero()));
  for (std::size_t k = 0; k < n; ++k) {
    const ContactEquation& c = problem.contacts[k];
    Mat3 frame;
    frame << c.normal, c.normal.unitOrthogonal(), c.normal.cross(c.normal.unitOrthogonal());
    const Vec3 u = frame.transpose() * (relative_velocity(c, free) + c.offset),
               r = frame.transpose() * problem.impulse[k];
    q.insert(q.end(), u.begin(), u.end());
    matrix.r.insert(matrix.r.end(), r.begin(), r.end());
    mu.push_back(c.mu);
    arms[at(c.first)].push_back(arm_of(problem, k, c.first, frame));
    if (c.second >= 0) arms[at(c.second)].push_back(arm_of(problem, k, c.second, frame));
    matrix.frames.push_back(frame);
  }
  std::vector<MatrixEntry> entries;
  for (const std::vector<Arm>& of_body : arms)
    for (const Arm& a : of_body)
      for (const Arm& b : of_body) {
        const Mat3 block = a.shift.transpose() * b.shift + a.turn.transpose() * b.turn;
        for (Eigen::Index i = 0; i < 3; ++i)
          for (Eigen::Index j = 0; j < 3; ++j)
            entries.push_back({static_cast<std::int64_t>(3 * a.contact) + i,
                               static_cast<std::int64_t>(3 * b.contact) + j, block(i, j)});
      }
  matrix.problem = assemble_delassus(entries, q, mu);
  return matrix;
}

}  // namespace talus
