#include "kernels/clusters/motion_norms.hpp"

#include <cmath>
#include <cstddef>

namespace talus {

std::vector<Twist> added(const std::vector<Twist>& a, double part, const std::vector<Twist>& b) {
  std::vector<Twist> sum(a);
  for (std::size_t k = 0; k < a.size(); ++k) {
    sum[k].u += part * b[k].u;
    sum[k].w += part * b[k].w;
  }
  return sum;
}

double momentum_of(const BodyProblem& problem, const std::vector<Twist>& motion) {
  double sum = 0;
  for (std::size_t b = 0; b < motion.size(); ++b)
    sum += problem.bodies[b].mass * motion[b].u.norm() + problem.bodies[b].spin_mass * motion[b].w.norm();
  return sum;
}

double kinetic_norm(const BodyProblem& problem, const std::vector<Twist>& motion) {
  double sum = 0;
  for (std::size_t b = 0; b < motion.size(); ++b)
    sum += kinetic2(problem.bodies[b], motion[b].u, motion[b].w);
  return std::sqrt(sum);
}

}  // namespace talus
