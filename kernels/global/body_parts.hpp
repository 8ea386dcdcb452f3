#pragma once

/// The contact problem over bodies in parts, one per subdomain, and the communication between the parts.
/// Copies of a body stand in several parts; of each exactly one counts. A solver written over parts gives the
/// same bits wherever they lie: what happens within a part depends on the part alone, and sums over parts are
/// added in order of subdomain.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "kernels/global/body_problem.hpp"

namespace talus {

/// Per part, a twist per unknown. Of velocities all copies of a body hold the same bits.
using PartField = std::vector<std::vector<Twist>>;

/// Bodies that no contact joins with those of other groups, over all parts: what is asked of a step is asked
/// of each group.
struct BodyGroups {
  std::vector<std::vector<std::int32_t>> of_body = {};  ///< per part and unknown; -1: in none
  std::int32_t count = 1;

  /// Without a list all bodies are in the first group.
  std::int32_t of(std::size_t part, std::size_t body) const {
    return of_body.empty() ? 0 : of_body[part][body];
  }
  std::size_t size() const { return static_cast<std::size_t>(count); }
};

/// Communication interface of the solvers over parts, between those of this process and of others. Every
/// process makes the same calls in the same order. The base class serves a single part and does nothing.
class PartLink {
 public:
  virtual ~PartLink() = default;

  /// There are other parts, here or elsewhere, that copies of a body may lie in.
  virtual bool several() const { return false; }

  /// Calls work(p) for each of the `parts` parts here, possibly in parallel.
  virtual void each(std::size_t parts, const std::function<void(std::size_t)>& work) const;

  /// Each copy of a shared unknown gets the sum of all copies, added in order of subdomain; w only where
  /// grains rotate.
  virtual void sum_copies(PartField& field) const;

  /// Takes one row of numbers of each part here, all of the same length, and returns on every process the
  /// rows of all parts of all processes, concatenated in order of subdomain.
  virtual std::vector<double> gather(std::vector<std::vector<double>> rows) const;
};

/// Calls `fill(part, row)` to fill a row of `width` numbers for each of the `parts` parts here, and returns
/// all rows as PartLink::gather does.
using PartRow = std::function<void(std::size_t, std::span<double>)>;
std::vector<double> rows_of(const PartLink& link, std::size_t parts, std::size_t width, const PartRow& fill);
/// The same, added up in order of subdomain.
std::vector<double> total_of(const PartLink& link, std::size_t parts, std::size_t width, const PartRow& fill);

/// Numbers of which some add up and of the others the largest counts: sums first. A row may have them several
/// times over, once for each group that is measured.
struct RowColumns {
  std::size_t sums, largest;  ///< numbers of either kind
  std::size_t width() const { return sums + largest; }
  /// Adds the sums of a row, and keeps the larger ones of the others; NaN where one is.
  void add(std::span<const double> row, std::span<double> to) const;
};
/// One row of what the parts have, `groups` times the columns, added in order of subdomain; nothing is less
/// than 0 in the columns of largest ones.
std::vector<double> reduced_of(const PartLink& link, std::size_t parts, RowColumns columns,
                               std::size_t groups, const PartRow& fill);

/// The parts here, ascending by subdomain, and their link. What it refers to must outlive it.
class BodyParts {
 public:
  BodyParts(std::span<const BodyProblem> parts, const PartLink& link) : parts_(parts), link_(&link) {}

  std::size_t size() const { return parts_.size(); }
  const BodyProblem& operator[](std::size_t part) const { return parts_[part]; }
  const PartLink& link() const { return *link_; }
  void each(const std::function<void(std::size_t)>& work) const { link_->each(size(), work); }

  /// A zero for every unknown.
  PartField field() const;

  std::vector<double> rows(std::size_t width, const PartRow& fill) const {
    return rows_of(*link_, size(), width, fill);
  }
  std::vector<double> total(std::size_t width, const PartRow& fill) const {
    return total_of(*link_, size(), width, fill);
  }
  std::vector<double> reduced(RowColumns columns, std::size_t groups, const PartRow& fill) const {
    return reduced_of(*link_, size(), columns, groups, fill);
  }

  /// Sum of a.b over all bodies, each once.
  double dot(const PartField& a, const PartField& b) const;

 private:
  std::span<const BodyProblem> parts_;
  const PartLink* link_;
};

/// Impulses of all parts: per part, one vector per contact.
using PartImpulses = std::vector<std::vector<Vec3>>;
PartImpulses impulses_of(const BodyParts& parts);

/// Adds what contacts do besides r (BodyProblem::known) to the velocities without contacts, in all parts.
/// Collective where a part has any.
void set_free(std::span<BodyProblem> parts, const PartLink& link);

/// V = V_free + M^-1 H r.
PartField velocities_of(const BodyParts& parts, const PartImpulses& impulse);
/// The same of the impulses that the parts have.
PartField velocities_of(const BodyParts& parts);

/// Per part, the unknowns that count there and are much heavier than what they touch: walls of finite mass,
/// and bodies of more than `ratio` times the mean mass of their neighbours; ascending.
std::vector<std::vector<std::int32_t>> heavy_unknowns(const BodyParts& parts, double ratio = 10);

}  // namespace talus
