#include "runtime/step/step_link.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "runtime/graph/clock.hpp"

namespace talus {

namespace {

void count(std::uint16_t& calls) {
  if (calls < trace::Meetings::most) ++calls;
}

}  // namespace

void StepLink::each(std::size_t parts, const std::function<void(std::size_t)>& work) const {
  if (ranks_.trace() == nullptr) return crew_.share(parts, work);
  std::vector<double> seconds(parts);
  const double began = graph::seconds_now();
  crew_.share(parts, [&](std::size_t part) {
    const double from = graph::seconds_now();
    work(part);
    seconds[part] = graph::seconds_now() - from;
  });
  shared_.elapsed += graph::seconds_now() - began;
  shared_.all += std::accumulate(seconds.begin(), seconds.end(), 0.0);
  shared_.longest += seconds.empty() ? 0 : *std::ranges::max_element(seconds);
}

void StepLink::sum_copies(PartField& field) const {
  if (!state_.decomposition.several()) return;
  count(rounds_.exchanges);
  const double began = graph::seconds_now();
  gluing_.sum_copies(field);
  shared_.waited += graph::seconds_now() - began;
}

std::vector<double> StepLink::gather(std::vector<std::vector<double>> rows) const {
  count(rounds_.gathers);
  const Decomposition& all = state_.decomposition;
  const std::size_t width = rows.front().size();
  std::vector<double> here;
  here.reserve(rows.size() * width);
  for (const std::vector<double>& row : rows) here.insert(here.end(), row.begin(), row.end());
  if (ranks_.ranks() == 1) return here;
  std::vector<std::size_t> lengths(static_cast<std::size_t>(ranks_.ranks()), 0);
  for (std::int32_t rank : all.rank_of) lengths[static_cast<std::size_t>(rank)] += width;
  const auto pending = ranks_.start_gather(std::move(here), lengths);
  const double began = graph::seconds_now();
  const std::vector<double>& by_rank = pending->wait();
  shared_.waited += graph::seconds_now() - began;
  // Within a rank rows stand in order of subdomain.
  std::vector<std::size_t> next(lengths.size(), 0);
  for (std::size_t r = 1; r < next.size(); ++r) next[r] = next[r - 1] + lengths[r - 1];
  std::vector<double> sorted;
  sorted.reserve(by_rank.size());
  for (std::int32_t rank : all.rank_of) {
    const auto begin = by_rank.begin() + static_cast<std::ptrdiff_t>(next[static_cast<std::size_t>(rank)]);
    sorted.insert(sorted.end(), begin, begin + static_cast<std::ptrdiff_t>(width));
    next[static_cast<std::size_t>(rank)] += width;
  }
  return sorted;
}

}  // namespace talus
