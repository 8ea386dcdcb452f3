#include "kernels/clusters/firm_contacts.hpp"

#include <array>
#include <limits>

#include "kernels/bodies/index.hpp"
#include "kernels/global/stiffness.hpp"

namespace talus {

namespace {

/// Each takes off what rounding has left, a millionth part of the step or less.
constexpr int refinements = 2;

/// Multiplications that take as long as it takes to put an entry into its place and to order it.
constexpr double work_of_entry = 30;

Eigen::Index freedoms_of_body(const BodyUnknown& body) {
  return body.wall ? 1 : body.spin_mass > 0 ? 6 : 3;
}

/// One number per freedom of a body.
struct Freedoms {
  Eigen::Index begin = 0, count = 0;
  std::array<double, 6> value{};
};

Freedoms freedoms(const BodyUnknown& body, Eigen::Index begin, const Twist& of) {
  Freedoms own{begin, freedoms_of_body(body), {}};
  if (body.wall) {
    own.value[0] = body.axis.dot(of.u);
    return own;
  }
  for (Eigen::Index k = 0; k < 3; ++k) {
    own.value[at(k)] = of.u[k];
    own.value[at(k + 3)] = of.w[k];
  }
  return own;
}

}  // namespace

FirmContacts::FirmContacts(const BodyProblem& problem, double firmness) : problem_(problem) {
  std::vector<ContactSpring> springs;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const ContactEquation& c = problem.contacts[k];
    rho_.push_back(firmness * effective_mass(problem, c));
    for (int axis = 0; axis < (c.mu > 0 ? 3 : 1); ++axis)
      springs.push_back({k, c.mu > 0 ? Vec3(Vec3::Unit(axis)) : c.normal, rho_.back()});
  }
  factorise(springs);
}

FirmContacts::FirmContacts(const BodyProblem& problem, std::span<const ContactSpring> springs)
    : problem_(problem) {
  factorise(springs);
}

void FirmContacts::factorise(std::span<const ContactSpring> springs) {
  begin_.push_back(0);
  for (const BodyUnknown& body : problem_.bodies) begin_.push_back(begin_.back() + freedoms_of_body(body));
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t b = 0; b < problem_.bodies.size(); ++b)
    for (Eigen::Index k = begin_[b]; k < begin_[b + 1]; ++k) {
      const BodyUnknown& body = problem_.bodies[b];
      entries.emplace_back(k, k, k - begin_[b] < 3 ? body.mass : body.spin_mass);
    }
  for (const ContactSpring& spring : springs) {
    const ContactEquation& c = problem_.contacts[spring.contact];
    // The contact as if its bodies were 0 and 1.
    ContactEquation alone = c;
    alone.first = 0;
    alone.second = c.second < 0 ? -1 : 1;
    std::array<Twist, 2> force{};
    add_force(alone, spring.direction, force);
    std::array<Freedoms, 2> column{};
    std::size_t bodies = 0;
    for (const std::int32_t b : {c.first, c.second})
      if (b >= 0) column[bodies] = freedoms(problem_.bodies[at(b)], begin_[at(b)], force[bodies]), ++bodies;
    for (std::size_t i = 0; i < bodies; ++i)
      for (std::size_t j = 0; j < bodies; ++j)
        for (Eigen::Index k = 0; k < column[i].count; ++k)
          for (Eigen::Index l = 0; l < column[j].count; ++l)
            entries.emplace_back(column[i].begin + k, column[j].begin + l,
                                 spring.stiffness * column[i].value[at(k)] * column[j].value[at(l)]);
  }
  matrix_.resize(begin_.back(), begin_.back());
  matrix_.setFromTriplets(entries.begin(), entries.end());
  factor_.compute(matrix_);
  work_ = work_of_entry * static_cast<double>(entries.size());
  if (factor_.info() != Eigen::Success) return;
  const auto& L = factor_.matrixL().nestedExpression();
  for (Eigen::Index k = 0; k < L.outerSize(); ++k) {
    const auto rows = static_cast<double>(L.outerIndexPtr()[k + 1] - L.outerIndexPtr()[k]);
    work_ += rows * rows;
  }
}

Eigen::VectorXd FirmContacts::freedoms_of(std::span<const Twist> of) const {
  Eigen::VectorXd x(begin_.back());
  for (std::size_t b = 0; b < of.size(); ++b) {
    const Freedoms own = freedoms(problem_.bodies[b], begin_[b], of[b]);
    for (Eigen::Index k = 0; k < own.count; ++k) x[own.begin + k] = own.value[at(k)];
  }
  return x;
}

std::vector<Twist> FirmContacts::twists_of(const Eigen::VectorXd& x) const {
  std::vector<Twist> twists(problem_.bodies.size());
  for (std::size_t b = 0; b < twists.size(); ++b) {
    const BodyUnknown& body = problem_.bodies[b];
    if (body.wall) {
      twists[b].u = x[begin_[b]] * body.axis;
      continue;
    }
    twists[b].u = x.segment<3>(begin_[b]);
    if (body.spin_mass > 0) twists[b].w = x.segment<3>(begin_[b] + 3);
  }
  return twists;
}

FirmContacts::Solution FirmContacts::solve(std::span<const Twist> force) const {
  const Eigen::VectorXd f = freedoms_of(force);
  Eigen::VectorXd x = Eigen::VectorXd::Constant(f.size(), std::numeric_limits<double>::quiet_NaN());
  Eigen::VectorXd last = x;
  if (factor_.info() == Eigen::Success) {
    x = factor_.solve(f);
    for (int k = 0; k < refinements; ++k) {
      last = factor_.solve(f - matrix_ * x);
      x += last;
    }
  }
  return {twists_of(x), twists_of(last)};
}

}  // namespace talus
