#include "kernels/clusters/freedoms.hpp"

#include "kernels/bodies/index.hpp"

namespace talus {

namespace {

Eigen::Index freedoms_of_body(const BodyUnknown& body) {
  return body.wall ? 1 : body.spin_mass > 0 ? 6 : 3;
}

}  // namespace

Freedoms::Freedoms(const BodyProblem& problem) : problem_(problem) {
  begin_.push_back(0);
  for (const BodyUnknown& body : problem.bodies) begin_.push_back(begin_.back() + freedoms_of_body(body));
}

Eigen::VectorXd Freedoms::masses() const {
  Eigen::VectorXd masses(size());
  for (std::size_t b = 0; b < problem_.bodies.size(); ++b)
    for (Eigen::Index k = 0; k < count(b); ++k)
      masses[begin_[b] + k] = k < 3 ? problem_.bodies[b].mass : problem_.bodies[b].spin_mass;
  return masses;
}

Freedoms::Part Freedoms::part(std::size_t body, const Twist& of) const {
  Part part{begin(body), count(body)};
  if (problem_.bodies[body].wall) {
    part.value[0] = problem_.bodies[body].axis.dot(of.u);
    return part;
  }
  part.value << of.u, of.w;
  return part;
}

Eigen::VectorXd Freedoms::of(std::span<const Twist> twists) const {
  Eigen::VectorXd x(size());
  for (std::size_t b = 0; b < twists.size(); ++b) {
    const Part own = part(b, twists[b]);
    x.segment(own.begin, own.count) = own.value.head(own.count);
  }
  return x;
}

std::vector<Twist> Freedoms::twists(const Eigen::VectorXd& x) const {
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

std::array<Freedoms::Part, 2> Freedoms::column(const ContactEquation& contact, const Vec3& direction) const {
  // The contact as if its bodies were 0 and 1.
  ContactEquation alone = contact;
  alone.first = 0;
  alone.second = contact.second < 0 ? -1 : 1;
  std::array<Twist, 2> force{};
  add_force(alone, direction, force);
  std::array<Part, 2> column{};
  column[0] = part(at(contact.first), force[0]);
  if (contact.second >= 0) column[1] = part(at(contact.second), force[1]);
  return column;
}

}  // namespace talus
