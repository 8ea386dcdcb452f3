#pragma once

/// The contact problem over bodies as a check reads it: bodies one at a time, contacts from front to back. A
/// check that is made now and then goes through the arrays of the step instead of a copy of the problem,
/// which takes some 650 bytes a grain.

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "kernels/global/body_problem.hpp"

namespace talus {

/// The whole problem, or the part of it that one subdomain holds; unknowns and contacts as in BodyProblem.
class ProblemReader {
 public:
  virtual ~ProblemReader() = default;

  virtual std::size_t unknowns() const = 0;
  virtual BodyUnknown unknown(std::size_t body) const = 0;
  virtual double mass(std::size_t body) const = 0;   ///< of unknown(body) [kg]
  virtual bool counted(std::size_t body) const = 0;  ///< BodyProblem::counted
  virtual std::size_t contacts() const = 0;

  /// visit(contact, r) for each contact in order, with its impulse r on the first body [N s].
  using Visit = std::function<void(const ContactEquation&, const Vec3&)>;
  virtual void each_contact(const Visit& visit) const = 0;
};

/// The parts of this process, ascending by subdomain.
using ProblemReaders = std::vector<std::unique_ptr<const ProblemReader>>;

}  // namespace talus
