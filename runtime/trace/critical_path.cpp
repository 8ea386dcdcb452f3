#include <algorithm>
#include <cmath>

#include "runtime/trace/analysis.hpp"

namespace talus::trace {
namespace {

/// A thread that did not wait is back at work within so many ns.
constexpr double no_wait = 300;

class Walker {
 public:
  Walker(const Timeline& timeline, const StepIndex& index)
      : timeline_(timeline), index_(index), tree_(tree_of(index)) {}

  std::vector<PathHop> walk() {
    std::vector<PathHop> path;
    Place at = last();
    double until = at.exists() ? record(at).end() : 0;
    // Each hop goes back in time, or to a rank that came later to the same call: never more than all records.
    for (std::size_t hops = timeline_.trace().record_count(); at.exists() && hops > 0; --hops) {
      const Cause cause = cause_of(at);
      path.push_back({at, std::min(cause.known, until), until});
      if (!cause.place.exists()) break;
      until = std::min(cause.left, path.back().from);
      at = cause.place;
    }
    return path;
  }

 private:
  /// What a record waited for: until when that was at work, and when the record could go on.
  struct Cause {
    Place place;
    double left = 0, known = 0;
  };

  const Record& record(Place place) const { return timeline_.record(place); }
  std::size_t rank_of(Place place) const {
    return static_cast<std::size_t>(timeline_.trace().tracks[place.track].rank);
  }
  void keep_later(Place& best, Place other, double limit) const {
    if (!other.exists() || record(other).end() > limit) return;
    if (!best.exists() || record(other).end() > record(best).end()) best = other;
  }

  Place last() const {
    Place best;
    for (const StepIndex::Rank& rank : index_.ranks)
      for (const Place& place : rank.task) keep_later(best, place, INFINITY);
    return best;
  }

  /// The task before on the same thread.
  Place previous(Place place) const {
    const Track& track = timeline_.trace().tracks[place.track];
    for (std::uint32_t i = place.record; i-- > 0;) {
      const Record& other = track.records[i];
      const Kind kind = other.kind();
      if (other.step() != index_.step) return {};
      if (kind == kind_team || is_communication(kind)) continue;
      if (other.end() > static_cast<double>(record(place).begin)) continue;
      if (other.epoch < 0 && kind != kind_outside && !is_task(place.track, i)) continue;
      return {place.track, i};
    }
    return {};
  }
  bool is_task(std::uint32_t track, std::uint32_t i) const {
    const Track& of = timeline_.trace().tracks[track];
    const auto& tasks = timeline_.trace().tasks[static_cast<std::size_t>(of.rank)];
    const Record& r = of.records[i];
    return r.node < tasks.size() && tasks[r.node].kind == r.kind();
  }

  /// What a task went on with, or none: the last message that it waited for; of calls of all ranks the
  /// longest, since in the first the others are awaited, and what comes behind has them together.
  Place deciding_wait(Place place) const {
    const Track& track = timeline_.trace().tracks[place.track];
    Place best;
    for (std::uint32_t i = place.record + 1; i < track.records.size(); ++i) {
      const Record& inside = track.records[i];
      if (static_cast<double>(inside.begin) >= record(place).end()) break;
      if (static_cast<double>(inside.duration) <= no_wait) continue;
      if (inside.kind() == kind_receive ||
          (inside.kind() == kind_collective && (!best.exists() || inside.duration > record(best).duration)))
        best = {place.track, i};
    }
    return best;
  }

  /// When a task that waits for all ranks had done its own work.
  double came(Place at) const {
    const Record& task = record(at);
    double own = timeline_.self(at);
    if (task.kind() == kind_check)
      own += timeline_.self(index_.ranks[rank_of(at)].alone[static_cast<std::size_t>(task.epoch)]);
    return static_cast<double>(task.begin) + own;
  }

  Cause cause_of(Place at) const {
    const auto begin = static_cast<double>(record(at).begin);
    if (const Place wait = deciding_wait(at); wait.exists()) {
      const bool message = record(wait).kind() == kind_receive;
      const Place cause = message ? sender_of(wait) : last_to_come(at);
      if (cause.exists() && !(cause.track == at.track && cause.record == at.record)) {
        return {cause, message ? record(cause).end() : came(cause), record(wait).end()};
      }
    }
    Place best = previous(at);
    if (!best.exists() || record(best).end() + no_wait < begin)
      for (const Place cause : causes(at)) keep_later(best, cause, begin + no_wait);
    return {best, best.exists() ? record(best).end() : begin, begin};
  }

  /// What a task waits for on its rank.
  std::vector<Place> causes(Place at) const {
    const Record& task = record(at);
    const StepIndex::Rank& rank = index_.ranks[rank_of(at)];
    const auto& tasks = timeline_.trace().tasks[rank_of(at)];
    std::vector<Place> list;
    if (task.kind() == kind_outside) return list;
    if (task.epoch < 0) {
      for (std::uint32_t before : tasks[task.node].predecessors)
        if (!tasks[before].team)
          list.push_back(rank.task[before]);
        else if (rank.epochs > 0)
          list.push_back(rank.check.back());
      list.push_back(rank.outside);
      return list;
    }
    const auto epoch = static_cast<std::size_t>(task.epoch);
    if (task.kind() == kind_check) {
      for (std::size_t n = 0; n < rank.nodes; ++n) list.push_back(rank.at(epoch, n));
      return list;
    }
    for (std::uint32_t other : rank.plan->neighbours(task.node)) {
      if (rank.plan->colour[other] < rank.plan->colour[task.node])
        list.push_back(rank.at(epoch, other));
      else if (epoch > 0)
        list.push_back(rank.at(epoch - 1, other));
    }
    if (epoch > 0) list.push_back(rank.check[epoch - 1]);
    for (std::size_t i = 0; i < tasks.size() && !tasks[i].team; ++i) list.push_back(rank.task[i]);
    return list;
  }

  /// A tell, or the publish of a group that has none.
  static bool tells(const Plan& plan, std::size_t n) {
    const auto is_tell = [&](std::size_t k) {
      return static_cast<Role>(plan.role[k]) == Role::tell && plan.group[k] == plan.group[n];
    };
    if (static_cast<Role>(plan.role[n]) != Role::publish) return is_tell(n);
    for (std::size_t k = 0; k < plan.size(); ++k)
      if (is_tell(k)) return false;
    return true;
  }

  /// The task that sent what was waited for.
  Place sender_of(Place wait) const {
    const Record& received = record(wait);
    const std::uint32_t from = received.node >> 16, to = received.node & 0xffffU;
    const auto epoch = static_cast<std::size_t>(received.epoch);
    Place best;
    // What goes down the tree is named after the rank that takes it, and its parent sends it.
    const auto has = [](const StepIndex::Rank& rank, std::uint32_t group) {
      return rank.plan &&
             std::find(rank.plan->group.begin(), rank.plan->group.end(), group) != rank.plan->group.end();
    };
    const StepIndex::Rank* speaks = nullptr;
    for (std::size_t r = 0; r < index_.ranks.size() && from == root_group; ++r)
      if (tree_.parent[r] >= 0 && has(index_.ranks[r], to))
        speaks = &index_.ranks[static_cast<std::size_t>(tree_.parent[r])];
    for (const StepIndex::Rank& rank : index_.ranks) {
      if (!rank.plan || epoch >= rank.epochs) continue;
      if (from == root_group ? &rank != speaks : !has(rank, from)) continue;
      for (std::size_t n = 0; n < rank.nodes; ++n) {
        const Role role = static_cast<Role>(rank.plan->role[n]);
        const bool sends = from == root_group || (to == root_group && role == Role::root) ? role == Role::root
                           : to == root_group ? tells(*rank.plan, n)
                                              : role == Role::publish && rank.plan->group[n] == from;
        if (sends) keep_later(best, rank.at(epoch, n), received.end());
      }
    }
    return best;
  }

  /// The same task on the rank that came to its collective call last.
  Place last_to_come(Place at) const {
    const Record& task = record(at);
    Place best;
    double latest = -INFINITY;
    for (std::size_t r = 0; r < index_.ranks.size(); ++r) {
      const StepIndex::Rank& rank = index_.ranks[r];
      Place there;
      if (task.kind() == kind_check) {
        if (static_cast<std::size_t>(task.epoch) < rank.epochs)
          there = rank.check[static_cast<std::size_t>(task.epoch)];
      } else if (task.kind() == kind_outside) {
        there = rank.outside;
      } else {
        const auto& tasks = timeline_.trace().tasks[r];
        for (std::size_t i = 0; i < tasks.size(); ++i)
          if (tasks[i].kind == task.kind()) there = rank.task[i];
      }
      if (!there.exists()) continue;
      if (came(there) <= latest) continue;
      latest = came(there);
      best = there;
    }
    return best;
  }

  const Timeline& timeline_;
  const StepIndex& index_;
  graph::Tree tree_;  ///< of the ranks
};

}  // namespace

std::vector<PathHop> critical_path(const Timeline& timeline, const StepIndex& index) {
  return Walker(timeline, index).walk();
}

}  // namespace talus::trace
