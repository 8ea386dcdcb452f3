#include "kernels/global/newton_step.hpp"

#include "kernels/global/stiffness.hpp"
#include "kernels/law/friction_cone.hpp"

namespace talus {

LawDefect law_defect(const BodyParts& parts) {
  const PartField V = velocities_of(parts, impulses_of(parts));
  enum { residual2, energy, rough, width };
  const std::vector<double> sums = parts.total(width, [&](std::size_t p, std::span<double> row) {
    const BodyProblem& problem = parts[p];
    for (std::size_t b = 0; b < problem.bodies.size(); ++b)
      if (problem.counted(b)) row[energy] += 0.5 * kinetic2(problem.bodies[b], V[p][b].u, V[p][b].w);
    for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
      const ContactEquation& c = problem.contacts[k];
      const Vec3& r = problem.impulse[k];
      const Vec3 v = constrained(c, relative_velocity(c, V[p]) + c.offset);
      const double m = effective_mass(problem, c);
      const Vec3 shifted = v + c.mu * tangential(c, v).norm() * c.normal;
      row[residual2] += (r - project_on_cone(r - m * shifted, c.normal, c.mu)).squaredNorm() / m;
      row[energy] += c.offset.dot(r);
      row[rough] += c.mu > 0 ? 1 : 0;
    }
  });
  return {sums[residual2], sums[energy], sums[rough] > 0};
}

bool take_newton_step(std::span<BodyProblem> problems, const PartLink& link, const PartImpulses& change) {
  const BodyParts parts(problems, link);
  PartImpulses before = impulses_of(parts);
  const LawDefect then = law_defect(parts);
  for (std::size_t p = 0; p < problems.size(); ++p)
    for (std::size_t k = 0; k < problems[p].contacts.size(); ++k) {
      const ContactEquation& c = problems[p].contacts[k];
      problems[p].impulse[k] = project_on_cone(problems[p].impulse[k] + change[p][k], c.normal, c.mu);
    }
  const LawDefect now = law_defect(parts);
  // Comparisons are false for NaN.
  if (now.residual2 < then.residual2 || (!now.friction && now.energy < then.energy)) return true;
  for (std::size_t p = 0; p < problems.size(); ++p) problems[p].impulse = std::move(before[p]);
  return false;
}

}  // namespace talus
