#include "apps/study_certificate/step_gaps.hpp"

#include <algorithm>
#include <cmath>

namespace talus::audit {

bool meets(const GapNumbers& numbers, const Approach& pair, double restitution, double reach, double& bias) {
  if (pair.gap >= numbers.alert && pair.gap + numbers.h * pair.v_free >= 0) return false;
  bias = std::max(0.0, pair.gap) / numbers.h;
  if (restitution > 0 && (numbers.slow == 0 || std::abs(pair.v_n) > numbers.slow)) {
    // An elastic pair that touches is a contact, and one that nearly does is none.
    const bool apart = pair.in_run == InRun::do_not && restitution >= 1 && pair.v_n >= 0;
    if (apart && pair.gap <= 0) return false;
    const bool closes = pair.v_n < 0 && pair.gap + numbers.h * pair.v_free < 0;
    if (pair.gap <= 0 || pair.in_run == InRun::carry || (closes && pair.gap < numbers.turning))
      bias = restitution * pair.v_n;
    else if (closes || (restitution >= 1 && pair.gap > reach))
      return false;
  }
  // Moreau's law: of the mean velocity (v + E v-)/(1 + E).
  if (numbers.E > 0) bias = std::max(0.0, bias - numbers.E * pair.v_n) / (1 + numbers.E);
  return true;
}

double gap_on_the_way(const Vec3& normal, double gap, const Vec3& d, const Passing& passing) {
  const Vec3& way = passing.way;
  const double along = normal.dot(way);
  const Vec3 aside = way - along * normal;
  if (!(gap > passing.held && gap + along < 0 && aside.norm() > turned_normal * d.norm())) return gap;
  // By how far the line of the way passes the other centre, where that lies on it.
  const double length = way.norm(), before = -d.dot(way) / length,
               nearest = before < length ? (d + before / length * way).norm() : (d + way).norm(),
               passes = nearest - (d.norm() - gap);
  const bool meet = std::abs(passes) <= passing.rounding ? passing.carries : passes <= 0;
  return meet ? gap : passes - along;
}

}  // namespace talus::audit
