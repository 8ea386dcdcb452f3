#pragma once

// Problems over bodies that lie in memory, as a check reads them.

#include <cstddef>
#include <memory>
#include <vector>

#include "kernels/global/problem_reader.hpp"

namespace talus::test {

class Held final : public ProblemReader {
 public:
  explicit Held(const BodyProblem& problem) : problem_(problem) {}
  std::size_t unknowns() const override { return problem_.bodies.size(); }
  BodyUnknown unknown(std::size_t body) const override { return problem_.bodies[body]; }
  double mass(std::size_t body) const override { return problem_.bodies[body].mass; }
  bool counted(std::size_t body) const override { return problem_.counted(body); }
  std::size_t contacts() const override { return problem_.contacts.size(); }
  void each_contact(const Visit& visit) const override {
    for (std::size_t k = 0; k < contacts(); ++k) visit(problem_.contacts[k], problem_.impulse[k]);
  }

 private:
  const BodyProblem& problem_;
};

/// The problems must outlive the readers.
inline ProblemReaders readers_of(const std::vector<BodyProblem>& parts) {
  ProblemReaders readers;
  for (const BodyProblem& part : parts) readers.push_back(std::make_unique<Held>(part));
  return readers;
}

}  // namespace talus::test
