#include "kernels/delassus/delassus_auto.hpp"

#include <algorithm>
#include <array>
#include <cmath>
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

/// One of the methods, once it has begun.
struct Runner {
  std::function<void()> iterate;
  std::function<void(std::span<const double>)> begin_from;
  detail::OwnError* own = nullptr;  ///< null: has not begun
};

class Portfolio {
 public:
  Portfolio(const DelassusProblem& problem, const AutoSettings& settings, BestAnswer& answer)
      : problem_(problem),
        settings_(settings),
        answer_(answer),
        sweep_(sweep_cost(problem)),
        start_(answer.best().begin(), answer.best().end()),
        first_error_(answer.least()),
        digits_(std::max(1.0, std::log10(answer.least() / answer.goal().tolerance))) {
    begin(momentum);
  }

  void run() {
    while (!answer_.over() && work(momentum) + work_of_others() < answer_.goal().most_work) {
      const Method next = choose();
      Runner& runner = runner_[next];
      if (!runner.own) begin(next);
      const double part = next == momentum ? settings_.still_sweeps : settings_.still;
      if (stands_still(next, part)) begin_anew(next);
      const double until = runner.own->work() + settings_.slice * work(momentum);
      do runner.iterate();
      while (!answer_.over() && usable(next) && runner.own->work() < until);
    }
    answer_.report().work = work(momentum) + work_of_others();
  }

 private:
  enum Method : std::size_t { momentum, conjugate, newton, admm };

  template <class Solver>
  void adopt(Method method, Solver& solver) {
    runner_[method] = {[&] { solver.iterate(answer_); },
                       [&](std::span<const double> r) { solver.begin_from(r); }, &solver.progress()};
    solver.progress().begin(answer_.least());
  }
  void begin(Method method) {
    using Start = SweepIteration::Start;
    const std::span<const double> r = answer_.best();
    switch (method) {
      case momentum:
        return adopt(method, momentum_.emplace(problem_, Start::momentum, SweepSettings{}, r));
      case conjugate:
        return adopt(method, conjugate_.emplace(problem_, Start::conjugate, SweepSettings{}, r));
      case newton:
        return adopt(method, newton_.emplace(*form_, NewtonSettings{}, r));
      case admm:
        return adopt(method, admm_.emplace(*form_, AdmmSettings{}, r));
    }
  }

  /// Sends a method that stands still to the best r of all. Newton, which then takes the same way again where
  /// that r is its own, goes back to where the solve began.
  void begin_anew(Method method) {
    Runner& runner = runner_[method];
    if (answer_.least() < settings_.better * runner.own->least()) {
      runner.begin_from(answer_.best());
      runner.own->begin(answer_.least());
    } else if (method == newton && runner.own->work_since_begin() > settings_.patience * usual(newton)) {
      runner.begin_from(start_);
      runner.own->begin(first_error_);
    }
  }

  double work(Method method) const { return runner_[method].own ? runner_[method].own->work() : 0; }
  double work_of_others() const { return analysis_ + work(conjugate) + work(newton) + work(admm); }
  bool usable(Method method) const { return method != admm || !admm_ || admm_->regular(); }
  bool stands_still(Method method, double part) const {
    const detail::OwnError& own = *runner_[method].own;
    return own.work_since_least() > std::max(part * own.work_since_begin(), 0.75 * usual(method));
  }

  /// What a method usually takes; before so much work nothing is said of it.
  double usual(Method method) const {
    switch (method) {
      case momentum:
        return settings_.sweeps_first * sweep_;
      case conjugate:
        return std::max(settings_.sweeps_first * sweep_, work(momentum));
      case newton:
        return settings_.newton_steps * (form_->factorisation_cost() + 8 * sweep_);
      case admm:
        return form_->factorisation_cost() + settings_.admm_decade * digits_ * admm_cost(problem_);
    }
    return never;
  }
  double remaining(Method method) const {
    const detail::OwnError* own = runner_[method].own;
    if (!own) return usual(method);
    const double spent = own->work_since_begin();
    return std::min(own->remaining(answer_.goal().tolerance),
                    std::max(usual(method) - spent, settings_.patience * spent));
  }

  /// Whether methods that factorise may be asked: what they need is made when it is worth finding out.
  bool factorises() {
    if (form_ || !lawful_) return lawful_;
    const double analysis = detail::analysis_cost(problem_);
    if (work(momentum) < 2 * analysis || remaining(momentum) < analysis) return false;
    std::int64_t failed = 0;
    lawful_ = lawful(problem_, failed);
    if (lawful_) {
      form_.emplace(problem_);
      analysis_ = analysis;
    }
    return lawful_;
  }

  Method choose() {
    const bool instead = stands_still(momentum, settings_.still);
    Method best = momentum;
    double left = never;
    const auto consider = [&](Method method) {
      if (const double own = remaining(method); usable(method) && own < left) {
        left = own;
        best = method;
      }
    };
    if (instead || conjugate_) consider(conjugate);
    if (factorises()) {
      consider(newton);
      consider(admm);
    }
    if (best == momentum) return momentum;
    const detail::OwnError* own = runner_[best].own;
    double most = settings_.others_always;
    if (instead)
      most = settings_.others_instead;
    else if (left < remaining(momentum))
      most = own && own->remaining(answer_.goal().tolerance) <= left ? settings_.others_falling
                                                                     : settings_.others;
    // A method begins when its first factorisation is within its share.
    const double first = own || best == conjugate ? 0 : form_->factorisation_cost();
    return work_of_others() + first < most * work(momentum) ? best : momentum;
  }

  const DelassusProblem& problem_;
  const AutoSettings& settings_;
  BestAnswer& answer_;
  double sweep_;               ///< multiplications of a sweep
  std::vector<double> start_;  ///< where the solve began, and its error
  double first_error_;
  double digits_;        ///< decades by which the error has to fall, >= 1
  double analysis_ = 0;  ///< work that form_ took
  bool lawful_ = true;
  std::optional<detail::FactorisedForm> form_;
  std::optional<SweepIteration> momentum_, conjugate_;
  std::optional<NewtonIteration> newton_;
  std::optional<AdmmIteration> admm_;
  std::array<Runner, 4> runner_;
};

}  // namespace

DelassusReport solve_auto(const DelassusProblem& problem, const DelassusGoal& goal,
                          const AutoSettings& settings, std::span<double> r) {
  BestAnswer answer(problem, goal, r);
  if (!answer.over()) Portfolio(problem, settings, answer).run();
  return answer.hand_back();
}

}  // namespace talus
