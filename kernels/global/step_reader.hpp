#pragma once

#include <array>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "kernels/bodies/index.hpp"
#include "kernels/detection/kept_impulses.hpp"
#include "kernels/global/problem_reader.hpp"

namespace talus {

/// The problem of a step, each unknown and equation made from the arrays of the step when it is asked for.
class StepReader final : public ProblemReader {
 public:
  /// All of it, or what one subdomain holds. Keeps what the source and the part refer to.
  explicit StepReader(const BodyProblemSource& source, std::optional<BodyProblemPart> part = {});

  std::size_t unknowns() const override { return grains() + walls_.size() + (has_cell() ? 1 : 0); }
  BodyUnknown unknown(std::size_t body) const override;
  double mass(std::size_t body) const override;
  bool counted(std::size_t body) const override;
  std::size_t contacts() const override;
  void each_contact(const Visit& visit) const override;

  std::size_t grains() const { return end_ - begin_; }  ///< unknowns before the first wall
  /// Unknown of a cell that follows a stress; -1: there is none.
  std::int32_t cell() const { return has_cell() ? static_cast<std::int32_t>(unknowns()) - 1 : -1; }
  std::int32_t subdomain() const { return part_ ? part_->subdomain : 0; }
  bool in_parts() const { return part_.has_value(); }
  bool shared(std::size_t body) const;  ///< has copies in other parts

  /// visit(chunk, place in Contacts) for each contact in order.
  template <class Visit>
  void each_place(const Visit& visit) const {
    for (std::size_t c = 0; c < source_.chunks.size(); ++c) {
      if (part_ && source_.chunks.subdomain[c] != part_->local) continue;
      const std::size_t begin = at(source_.chunks.begin[c]);
      for (std::size_t k = begin; k < begin + at(source_.contacts.count[c]); ++k) visit(c, k);
    }
  }
  /// Unknowns of the contact there; the second -1 at a driven wall.
  std::array<std::int32_t, 2> pair_at(std::size_t chunk, std::size_t place) const;
  ContactEquation equation_at(std::size_t chunk, std::size_t place) const;
  Vec3 impulse_of(const ContactEquation& contact) const;  ///< on its first body [N s]
  bool rolls() const { return !source_.contacts.arm.empty(); }
  RollingPart rolling_at(std::size_t place) const;  ///< where it rolls

  /// Contacts do something besides r (BodyProblem::known).
  bool knows_more() const { return !source_.contacts.cohesion.empty() || rolls(); }
  /// Adds what they do, per unknown [N s].
  void add_known(std::span<Twist> known) const;
  /// Velocities without contacts instead of those of the source: an entry per unknown. Walls are given them
  /// as unknowns, while equations go on from those of the source.
  void set_free(std::vector<Twist> free) { free_ = std::move(free); }

  /// Impulses and moments are those that candidates keep instead of those of the contacts, which sweeps have
  /// changed since. `kept` has to live as long as the reader.
  void set_kept(const KeptImpulses& kept) { kept_ = &kept; }

 private:
  bool has_cell() const { return source_.cell.mass > 0; }
  Vec3 moment_at(std::size_t place) const;
  std::size_t candidate_at(std::size_t place) const { return at(source_.contacts.candidate[place]); }
  double copies(std::size_t slot) const { return source_.parts.empty() ? 1 : source_.parts[slot]; }
  BodyUnknown unknown_of_source(std::size_t body) const;
  BodyUnknown unknown_of_slot(std::size_t slot) const;
  void add_moment(std::size_t place, const ContactEquation& contact, std::span<Twist> known) const;
  double drive_of_flow(const ContactEquation& contact, const Vec3& drift) const;

  BodyProblemSource source_;
  std::optional<BodyProblemPart> part_;
  std::size_t begin_, end_;                 ///< slots
  std::vector<std::size_t> walls_;          ///< of finite mass, by number
  std::vector<std::int32_t> wall_unknown_;  ///< per wall; -1 of driven ones
  std::vector<Twist> free_;
  const KeptImpulses* kept_ = nullptr;
};

/// Puts the problem together, as gather_problem of the source does.
BodyProblem gather_problem(const StepReader& step);

/// What of the bodies to take along that are not asked for. All keep their numbers.
enum class OtherBodies : char {
  as_they_are,
  empty,  ///< a grain without mass, as no contact that is taken touches it: of 16,000, some 2 ms
};
/// Its contacts whose first body is `taken`, an entry per unknown, or all where that is empty.
BodyProblem gather_problem(const StepReader& step, std::span<const char> taken, OtherBodies others);

}  // namespace talus
