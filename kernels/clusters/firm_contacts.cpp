#include "kernels/clusters/firm_contacts.hpp"

#include "kernels/global/stiffness.hpp"

namespace talus {

namespace {

/// Each takes off what rounding has left, a millionth part of the step or less.
constexpr int refinements = 2;

/// Of each contact, along its normal, with friction in all directions.
std::vector<ContactSpring> springs_of(const BodyProblem& problem, double firmness) {
  std::vector<ContactSpring> springs;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const ContactEquation& c = problem.contacts[k];
    const double rho = firmness * effective_mass(problem, c);
    for (int axis = 0; axis < (c.mu > 0 ? 3 : 1); ++axis)
      springs.push_back({k, c.mu > 0 ? Vec3(Vec3::Unit(axis)) : c.normal, rho});
  }
  return springs;
}

}  // namespace

FirmContacts::FirmContacts(const BodyProblem& problem, double firmness, std::span<const MomentSpring> moments)
    : FirmContacts(problem, springs_of(problem, firmness), moments) {
  for (const ContactEquation& c : problem.contacts) rho_.push_back(firmness * effective_mass(problem, c));
}

FirmContacts::FirmContacts(const BodyProblem& problem, std::span<const ContactSpring> springs,
                           std::span<const MomentSpring> moments)
    : freedoms_(problem),
      masses_(freedoms_.masses()),
      columns_(columns_of(problem, freedoms_, springs, moments)),
      system_(freedoms_, masses_, pairs_of(columns_)) {
  for (const Column& column : columns_)
    Freedoms::each_two(column.parts, [&](std::size_t a, std::size_t b) {
      const Freedoms::Part &one = column.parts[a], &other = column.parts[b];
      system_.add(one.block, other.block, column.stiffness * one.value * other.value.transpose());
    });
  system_.factorise();
}

std::vector<FirmContacts::Column> FirmContacts::columns_of(const BodyProblem& problem,
                                                           const Freedoms& freedoms,
                                                           std::span<const ContactSpring> springs,
                                                           std::span<const MomentSpring> moments) {
  std::vector<Column> columns;
  for (const ContactSpring& spring : springs) {
    const ContactEquation& c = problem.contacts[spring.contact];
    columns.push_back({freedoms.column(c, spring.direction), spring.stiffness});
  }
  for (const MomentSpring& spring : moments)
    columns.push_back({freedoms.column_of_moment(spring.contact, spring.axis), spring.stiffness});
  return columns;
}

std::vector<BlockElimination::Pair> FirmContacts::pairs_of(std::span<const Column> columns) {
  std::vector<BlockElimination::Pair> pairs;
  for (const Column& column : columns)
    Freedoms::each_two(column.parts, [&](std::size_t a, std::size_t b) {
      if (a < b) pairs.push_back({column.parts[a].block, column.parts[b].block});
    });
  return pairs;
}

/// A x.
Eigen::VectorXd FirmContacts::product(const Eigen::VectorXd& x) const {
  Eigen::VectorXd y = masses_.cwiseProduct(x);
  for (const Column& column : columns_) {
    double stretch = 0;
    for (const Freedoms::Part& part : column.parts)
      stretch += part.value.head(part.count).dot(x.segment(part.begin, part.count));
    for (const Freedoms::Part& part : column.parts)
      y.segment(part.begin, part.count) += column.stiffness * stretch * part.value.head(part.count);
  }
  return y;
}

FirmContacts::Solution FirmContacts::solve(std::span<const Twist> force) const {
  const Eigen::VectorXd f = freedoms_.of(force);
  Eigen::VectorXd x = system_.solve(f), last = Eigen::VectorXd::Zero(x.size());
  for (int k = 0; k < refinements; ++k) {
    last = system_.solve(f - product(x));
    x += last;
  }
  return {freedoms_.twists(x), freedoms_.twists(last)};
}

}  // namespace talus
