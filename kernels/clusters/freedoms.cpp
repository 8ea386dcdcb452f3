#include "kernels/clusters/freedoms.hpp"

#include <algorithm>

#include "kernels/bodies/index.hpp"
#include "kernels/clusters/rolling_contacts.hpp"

namespace talus {

namespace {

Eigen::Index freedoms_of_body(const BodyUnknown& body) {
  return body.kind == BodyKind::wall ? 1 : body.spin_mass > 0 ? 6 : 3;
}

/// Unknowns before the cell.
std::size_t plain_bodies(const BodyProblem& problem) {
  return problem.bodies.size() - (problem.has_cell() ? 1 : 0);
}

}  // namespace

Freedoms::Freedoms(const BodyProblem& problem) : problem_(problem) {
  begin_.push_back(0);
  for (std::size_t b = 0; b < plain_bodies(problem); ++b)
    begin_.push_back(begin_.back() + freedoms_of_body(problem.bodies[b]));
  if (problem.has_cell())
    for (int half = 0; half < 2; ++half) begin_.push_back(begin_.back() + 3);
}

Eigen::VectorXd Freedoms::masses() const {
  Eigen::VectorXd masses(size());
  for (std::size_t block = 0; block < blocks(); ++block) {
    const BodyUnknown& body = problem_.bodies[std::min(block, problem_.bodies.size() - 1)];
    for (Eigen::Index k = 0; k < count(block); ++k)
      masses[begin_[block] + k] = k < 3 ? body.mass : body.spin_mass;
  }
  return masses;
}

Freedoms::Part Freedoms::part(std::size_t body, const Twist& of) const {
  Part part{static_cast<std::int32_t>(body), begin(body), count(body)};
  if (problem_.bodies[body].kind == BodyKind::wall) {
    part.value[0] = problem_.bodies[body].axis.dot(of.u);
    return part;
  }
  part.value << of.u, of.w;
  return part;
}

std::array<Freedoms::Part, 2> Freedoms::parts_of_cell(const Twist& of) const {
  Twist moves = of;
  restrict_to_freedoms(problem_.bodies.back(), moves);
  const std::size_t block = plain_bodies(problem_);
  std::array<Part, 2> parts{Part{static_cast<std::int32_t>(block), begin(block), 3},
                            Part{static_cast<std::int32_t>(block) + 1, begin(block + 1), 3}};
  parts[0].value.head<3>() = moves.u;
  parts[1].value.head<3>() = moves.w;
  return parts;
}

Eigen::VectorXd Freedoms::of(std::span<const Twist> twists) const {
  Eigen::VectorXd x(size());
  const auto take = [&](const Part& own) { x.segment(own.begin, own.count) = own.value.head(own.count); };
  for (std::size_t b = 0; b < plain_bodies(problem_); ++b) take(part(b, twists[b]));
  if (problem_.has_cell())
    for (const Part& half : parts_of_cell(twists.back())) take(half);
  return x;
}

std::vector<Twist> Freedoms::twists(const Eigen::VectorXd& x) const {
  std::vector<Twist> twists(problem_.bodies.size());
  for (std::size_t b = 0; b < plain_bodies(problem_); ++b) {
    const BodyUnknown& body = problem_.bodies[b];
    if (body.kind == BodyKind::wall) {
      twists[b].u = x[begin_[b]] * body.axis;
      continue;
    }
    twists[b].u = x.segment<3>(begin_[b]);
    if (body.spin_mass > 0) twists[b].w = x.segment<3>(begin_[b] + 3);
  }
  if (problem_.has_cell()) twists.back() = {x.segment<3>(x.size() - 6), x.segment<3>(x.size() - 3)};
  return twists;
}

Freedoms::Column Freedoms::column(const ContactEquation& contact, const Vec3& direction) const {
  // The contact as if its bodies were 0 and 1, and the cell 2.
  ContactEquation alone = contact;
  alone.first = 0;
  alone.second = contact.second < 0 ? -1 : 1;
  alone.cell = contact.cell < 0 ? -1 : 2;
  std::array<Twist, 3> force{};
  add_force(alone, direction, force);
  Column column{};
  column[0] = part(at(contact.first), force[0]);
  if (contact.second >= 0) column[1] = part(at(contact.second), force[1]);
  if (contact.cell >= 0) {
    const std::array<Part, 2> halves = parts_of_cell(force[2]);
    column[2] = halves[0];
    column[3] = halves[1];
  }
  return column;
}

Freedoms::Column Freedoms::column_of_moment(std::size_t number, const Vec3& axis) const {
  const ContactEquation& contact = problem_.contacts[number];
  const auto [first, second] = push_of_moment(problem_, number, axis);
  Column column{};
  column[0] = part(at(contact.first), first);
  if (contact.second >= 0) column[1] = part(at(contact.second), second);
  return column;
}

}  // namespace talus
