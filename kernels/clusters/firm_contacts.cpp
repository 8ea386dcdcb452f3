#include "kernels/clusters/firm_contacts.hpp"

#include <limits>

#include "kernels/global/stiffness.hpp"

namespace talus {

namespace {

/// Each takes off what rounding has left, a millionth part of the step or less.
constexpr int refinements = 2;

}  // namespace

FirmContacts::FirmContacts(const BodyProblem& problem, double firmness)
    : problem_(problem), freedoms_(problem) {
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
    : problem_(problem), freedoms_(problem) {
  factorise(springs);
}

void FirmContacts::factorise(std::span<const ContactSpring> springs) {
  std::vector<Eigen::Triplet<double>> entries;
  const Eigen::VectorXd masses = freedoms_.masses();
  for (Eigen::Index k = 0; k < masses.size(); ++k) entries.emplace_back(k, k, masses[k]);
  for (const ContactSpring& spring : springs) {
    const auto column = freedoms_.column(problem_.contacts[spring.contact], spring.direction);
    for (const Freedoms::Part& a : column)
      for (const Freedoms::Part& b : column)
        for (Eigen::Index k = 0; k < a.count; ++k)
          for (Eigen::Index l = 0; l < b.count; ++l)
            entries.emplace_back(a.begin + k, b.begin + l, spring.stiffness * a.value[k] * b.value[l]);
  }
  matrix_.resize(masses.size(), masses.size());
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

FirmContacts::Solution FirmContacts::solve(std::span<const Twist> force) const {
  const Eigen::VectorXd f = freedoms_.of(force);
  Eigen::VectorXd x = Eigen::VectorXd::Constant(f.size(), std::numeric_limits<double>::quiet_NaN());
  Eigen::VectorXd last = x;
  if (factor_.info() == Eigen::Success) {
    x = factor_.solve(f);
    for (int k = 0; k < refinements; ++k) {
      last = factor_.solve(f - matrix_ * x);
      x += last;
    }
  }
  return {freedoms_.twists(x), freedoms_.twists(last)};
}

}  // namespace talus
