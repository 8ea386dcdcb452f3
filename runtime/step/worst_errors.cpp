#include "runtime/step/worst_errors.hpp"

#include <algorithm>

namespace talus {

void WorstErrors::take(const WorstErrors& other) {
  if (other.contact_error > contact_error ||
      (other.contact_error == contact_error && other.contact < contact)) {
    contact_error = other.contact_error;
    contact = other.contact;
  }
  if (other.body_error > body_error || (other.body_error == body_error && other.body < body)) {
    body_error = other.body_error;
    body = other.body;
  }
}

WorstErrors worst_errors_of(const ProblemReaders& parts, const Residuals& residuals,
                            const UnknownNames& names) {
  WorstErrors worst;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const ProblemReader& problem = *parts[p];
    const std::span<const BodyId> ids = names.bodies[p];
    const auto id = [&](std::int32_t unknown) {
      return static_cast<std::int64_t>(ids[static_cast<std::size_t>(unknown)]);
    };
    std::size_t k = 0;
    problem.each_contact([&](const ContactEquation& c, const Vec3& /*impulse*/) {
      const double error = residuals.contact[p][k++];
      if (!(error > 0) || error < worst.contact_error) return;
      worst.take({error,
                  c.wall >= 0 ? BodyPair::at_wall(id(c.first), c.wall)
                              : BodyPair::of_bodies(id(c.first), id(c.second)),
                  0, 0});
    });
    for (std::size_t b = 0; b < problem.unknowns(); ++b) {
      const double error = residuals.body[p][b];
      if (!problem.counted(b) || problem.unknown(b).kind == BodyKind::cell) continue;  // a cell has no name
      if (!(error > 0) || error < worst.body_error) continue;
      worst.take({0,
                  {},
                  error,
                  b < ids.size() ? id(static_cast<std::int32_t>(b))
                                 : -1 - std::int64_t{names.walls[b - ids.size()]}});
    }
  }
  return worst;
}

}  // namespace talus
