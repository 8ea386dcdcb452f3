#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace talus {

/// When the stiffness found in an earlier step may be used for this one.
struct StiffnessReuse {
  /// Grains are alike when the heaviest has less than so many times the mass of the lightest, > 1: no single
  /// grain that lands then changes everything.
  double alike = 1000;
  /// Number of times that candidates are found anew after which too much has moved: the answer is dropped,
  /// >= 0.
  int most_renewals = 10;
  /// The answer is used only for a problem that was far from stiff: this multiple of its sweeps is below the
  /// number that makes a problem stiff, >= 1.
  double margin = 2;
  /// The answer is used only while the number of contacts changes by at most this fraction: one in so many,
  /// >= 1.
  std::int64_t same_contacts = 20;
};

/// How many plain sweeps the problem takes. The estimate costs as much as ten sweeps, and two messages for
/// each layer of grains, so the answer is kept for later steps as long as it holds.
class StiffnessMemory {
 public:
  /// What the answer depends on.
  struct Problem {
    std::int64_t contacts = 0;
    std::vector<double> carrying;  ///< per wall 1/M [1/kg] where it carries, else -1
  };

  explicit StiffnessMemory(const StiffnessReuse& reuse = {}) : reuse_(reuse) {}

  /// Candidates were found anew. `spread`: the heaviest grain over the lightest.
  void renew(double spread);
  /// A new step: its problem is not known yet.
  void begin_step() { now_ = unknown; }
  /// The first call in a step takes the last answer if that holds for `problem`, else calls `estimate`; later
  /// calls in the step repeat the answer. `stiff`: sweeps from which the problem is stiff. The same on all
  /// ranks when they pass the same.
  double sweeps_needed(const Problem& problem, double stiff, const std::function<double()>& estimate);
  bool grains_alike() const { return spread_ < reuse_.alike; }
  /// The mass of the heaviest grain over that of the lightest.
  double spread() const { return spread_; }

  /// visit(name, member) for each member of a state, which may be const.
  template <class Memory, class Visit>
  static void each_number(Memory& memory, const Visit& visit) {
    visit("stiffness", memory.then_);
    visit("stiffness_contacts", memory.problem_.contacts);
    visit("stiffness_carrying", memory.problem_.carrying);
    visit("stiffness_renewals", memory.renewals_);
    visit("stiffness_spread", memory.spread_);
  }

 private:
  static constexpr double unknown = -1;
  bool holds(const Problem& problem, double stiff) const;

  StiffnessReuse reuse_;
  double now_ = unknown;   ///< of this step
  double then_ = unknown;  ///< the last estimate
  Problem problem_;        ///< for which that was made
  int renewals_ = 0;       ///< of the candidates since
  double spread_ = 1;
};

}  // namespace talus
