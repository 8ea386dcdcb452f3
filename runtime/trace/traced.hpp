#pragma once

#include <concepts>
#include <cstdint>
#include <optional>

#include "runtime/graph/epoch_loop.hpp"
#include "runtime/trace/recorder.hpp"

namespace talus::trace {

/// A program of the epoch loop that can say what its nodes do.
template <class Program>
concept NamedProgram = graph::EpochProgram<Program> &&
    requires(const Program& program, std::uint32_t node, int epoch) {
  /// An empty result: the node does nothing in this epoch, and leaves no record.
  { program.kind(node, epoch) } -> std::convertible_to<std::optional<Kind>>;
};

/// Forwards to a program of the epoch loop. A view that changes one thing derives from it and hides the one
/// member that differs.
template <NamedProgram Program>
class View {
 public:
  explicit View(Program& program) : program_(program) {}
  bool gate(int epoch) { return program_.gate(epoch); }
  void assist() {
    if constexpr (requires { program_.assist(); }) program_.assist();
  }
  bool decide(int epoch) { return program_.decide(epoch); }
  bool settles(int epoch) const {
    if constexpr (requires { program_.settles(epoch); }) return program_.settles(epoch);
    return false;
  }
  std::optional<Kind> kind(std::uint32_t node, int epoch) const { return program_.kind(node, epoch); }
  /// Empty for a node of no subdomain, or a program without subdomains.
  std::optional<std::size_t> subdomain_of(std::uint32_t node) const {
    if constexpr (requires { program_.subdomain_of(node); }) return program_.subdomain_of(node);
    return std::nullopt;
  }
  void fetch(std::size_t subdomain) {
    if constexpr (requires { program_.fetch(subdomain); }) program_.fetch(subdomain);
  }

 protected:
  Program& program_;
};

/// One thread's view of a program of the epoch loop that records each node: the loop itself stays as it is,
/// so a run without a trace has not one instruction more per node. Reading the clock is most of its cost, so
/// a node that waited for nothing begins where the last one ended, without a reading of its own.
template <NamedProgram Program>
class Traced : public View<Program> {
 public:
  Traced(Program& program, Recorder& recorder, int thread)
      : View<Program>(program), recorder_(recorder), track_(recorder.track(thread)) {}
  ~Traced() { track_.at_epoch(-1); }
  Traced(const Traced&) = delete;
  Traced& operator=(const Traced&) = delete;

  void node(std::uint32_t node, int epoch) {
    const std::optional<Kind> kind = program_.kind(node, epoch);
    if (!kind) return program_.node(node, epoch);
    if (recorder_.own_caches()) bring_in(node);
    const std::int64_t begin = last_end_ >= 0 ? last_end_ : recorder_.now();
    program_.node(node, epoch);
    last_end_ = recorder_.now();
    track_.add(begin, last_end_, node, epoch, *kind);
  }
  void about_to_wait() { last_end_ = -1; }
  bool gate(int epoch) {
    last_end_ = -1;  // threads meet at decisions
    track_.at_epoch(epoch);
    return program_.gate(epoch);
  }
  bool decide(int epoch) {
    const std::int64_t begin = recorder_.now();
    const std::uint32_t how = this->settles(epoch) ? check_settles : 0;
    const bool goes_on = program_.decide(epoch);
    track_.add(begin, recorder_.now(), how, epoch, kind_check);
    return goes_on;
  }

 private:
  void bring_in(std::uint32_t node) {
    const std::optional<std::size_t> subdomain = this->subdomain_of(node);
    if (!subdomain || subdomain == at_hand_) return;
    at_hand_ = subdomain;
    this->fetch(*subdomain);
    last_end_ = -1;
  }

  using View<Program>::program_;
  Recorder& recorder_;
  Recorder::Track& track_;
  std::optional<std::size_t> at_hand_;  ///< subdomain whose data were fetched last
  std::int64_t last_end_ = -1;  ///< [ns] of a node with nothing between it and what comes next; else -1
};

}  // namespace talus::trace
