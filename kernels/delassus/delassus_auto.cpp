#include "kernels/delassus/delassus_auto.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "kernels/delassus/delassus_admm.hpp"
#include "kernels/delassus/delassus_sweeps.hpp"
#include "kernels/delassus/newton.hpp"

namespace talus {
namespace {

constexpr double never = std::numeric_limits<double>::infinity();

class Portfolio {
 public:
  Portfolio(const DelassusProblem& problem, const AutoSettings& settings, BestAnswer& answer)
      : problem_(problem), settings_(settings), answer_(answer), sweep_(sweep_cost(problem)) {
    start(momentum);
  }

  void run() {
    const double first = answer_.least();
    while (!answer_.over()) {
      if (progress(momentum).work() < 30 * sweep_) {
        momentum_->iterate(answer_);
        continue;
      }
      if (!form_ && factorising_ && progress(momentum).work() > 30 * sweep_) {
        std::int64_t failed = 0;
        factorising_ = lawful(problem_, failed);
      }
      const std::size_t next = choose();
      if (!started(next)) start(next);
      exchange(next);
      const double until = progress(next).work() + settings_.slice * progress(next).work();
      do
        iterate(next);
      while (!answer_.over() && progress(next).work() < until);
    }
    if (getenv("TRACE")) {
      fprintf(stderr, "first %g least %g:", first, answer_.least());
      for (std::size_t k = 0; k < methods; ++k)
        if (started(k)) fprintf(stderr, " %c %.0f sweeps (%.1e)", "MCNA"[k], progress(k).work() / sweep_, progress(k).least());
      fprintf(stderr, "\n");
    }
  }

 private:
  enum Method : std::size_t { momentum, conjugate, newton, admm };
  static constexpr std::size_t methods = 4;

  bool started(std::size_t k) const {
    return k == momentum || (k == conjugate && conjugate_) || (k == newton && newton_) || (k == admm && admm_);
  }
  detail::OwnError& progress(std::size_t k) {
    switch (k) {
      case momentum: return momentum_->progress();
      case conjugate: return conjugate_->progress();
      case newton: return newton_->progress();
      default: return admm_->progress();
    }
  }
  void iterate(std::size_t k) {
    switch (k) {
      case momentum: return momentum_->iterate(answer_);
      case conjugate: return conjugate_->iterate(answer_);
      case newton: return newton_->iterate(answer_);
      default: return admm_->iterate(answer_);
    }
  }
  void begin_from_best(std::size_t k) {
    switch (k) {
      case momentum: momentum_->begin_from(answer_.best()); break;
      case conjugate: conjugate_->begin_from(answer_.best()); break;
      case newton: newton_->begin_from(answer_.best()); break;
      default: admm_->begin_from(answer_.best()); break;
    }
    progress(k).begin(answer_.least());
  }
  const detail::FactorisedForm& form() {
    if (!form_) form_.emplace(problem_);
    return *form_;
  }
  void start(std::size_t k) {
    using Start = SweepsOnTheWay::Start;
    switch (k) {
      case momentum: momentum_.emplace(problem_, Start::momentum, SweepSettings{}, answer_.best()); break;
      case conjugate: conjugate_.emplace(problem_, Start::conjugate, SweepSettings{}, answer_.best()); break;
      case newton: newton_.emplace(form(), NewtonSettings{}, answer_.best()); break;
      default: admm_.emplace(form(), AdmmSettings{}, answer_.best()); break;
    }
    progress(k).begin(answer_.least());
  }
  /// Work that a method needs before anything may be said of it.
  double prior(std::size_t k) {
    switch (k) {
      case momentum: return 30 * sweep_;
      case conjugate: return std::max(40 * sweep_, progress(momentum).work());
      case newton: return 8 * form().factorisation_cost(false);
      default: return form().factorisation_cost(true) + 60 * 3 * sweep_;
    }
  }
  double remaining(std::size_t k) {
    const double first = prior(k);
    if (!started(k)) return first;
    detail::OwnError& own = progress(k);
    const double spent = own.work_since_begin();
    const double expected = std::max(first - spent, settings_.patience * spent);
    return std::min(own.remaining(answer_.goal().tolerance), expected);
  }
  bool available(std::size_t k) {
    if (k == momentum || k == conjugate) return true;
    if (!factorising_) return false;
    if (k == admm && admm_ && !admm_->regular()) return false;
    return true;
  }
  std::size_t choose() {
    std::array<double, methods> left{}, weight{};
    double least = never, most = 0;
    for (std::size_t k = 0; k < methods; ++k) {
      left[k] = available(k) ? remaining(k) : never;
      least = std::min(least, left[k]);
    }
    for (std::size_t k = 0; k < methods; ++k) {
      if (left[k] == never) continue;
      weight[k] = std::max(settings_.share, least * least / (left[k] * left[k]));
      most = std::max(most, started(k) ? progress(k).work() : 0.0);
    }
    std::size_t next = momentum;
    double lowest = never;
    for (std::size_t k = 0; k < methods; ++k) {
      if (left[k] == never) continue;
      // One that has not begun is asked for when its share pays for its first steps.
      const double begins = started(k) ? 0 : prior(k) / 4;
      const double at = ((started(k) ? progress(k).work() : 0.0) + begins) / weight[k];
      if (at < lowest) {
        lowest = at;
        next = k;
      }
    }
    return next;
  }
  void exchange(std::size_t k) {
    detail::OwnError& own = progress(k);
    if (answer_.least() < settings_.better * own.least() && remaining(k) > own.work_since_begin())
      begin_from_best(k);
  }

  const DelassusProblem& problem_;
  const AutoSettings& settings_;
  BestAnswer& answer_;
  double sweep_;
  bool factorising_ = true;
  std::optional<detail::FactorisedForm> form_;
  std::optional<SweepsOnTheWay> momentum_, conjugate_;
  std::optional<NewtonOnTheWay> newton_;
  std::optional<AdmmOnTheWay> admm_;
};

}  // namespace

DelassusReport solve_auto(const DelassusProblem& problem, const DelassusGoal& goal, const AutoSettings& settings,
                          std::span<double> r) {
  BestAnswer answer(problem, goal, r);
  if (answer.over()) return answer.hand_back();
  Portfolio(problem, settings, answer).run();
  return answer.hand_back();
}

}  // namespace talus
