#include "kernels/samples/size_distribution.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "kernels/samples/detail/random_numbers.hpp"

namespace talus {

namespace {

using Kind = SizeDistribution::Kind;

/// Grains of a sieve class of unit mass, by number, between two radii; up to a factor that all classes share.
double number_between(double low, double high) {
  return (1 / (low * low) - 1 / (high * high)) / (2 * (high - low));
}

std::string bounds_fault(const SizeDistribution& sizes) {
  if (!(sizes.max > 0)) return "largest radius must be > 0 m, got " + std::to_string(sizes.max);
  if (sizes.kind != Kind::constant && !(sizes.min > 0 && sizes.min <= sizes.max))
    return "smallest radius must lie in (0, " + std::to_string(sizes.max) + "] m, got " +
           std::to_string(sizes.min);
  return "";
}

/// What is cut off must not be nearly all.
std::string bell_fault(const SizeDistribution& sizes) {
  if (!(sizes.mean > 0 && sizes.deviation > 0)) return "mean and deviation of the radii must be > 0";
  constexpr double far = 3;  // deviations: one radius in 700 is drawn beyond
  const bool logarithmic = sizes.kind == Kind::lognormal;
  const double low = logarithmic ? sizes.mean * detail::portable_exp(-far * sizes.deviation)
                                 : sizes.mean - far * sizes.deviation;
  const double high = logarithmic ? sizes.mean * detail::portable_exp(far * sizes.deviation)
                                  : sizes.mean + far * sizes.deviation;
  if (sizes.max < low || sizes.min > high)
    return "radius_min and radius_max leave out all radii within three deviations";
  if (sizes.max - sizes.min < 0.01 * (high - low))
    return "radius_min and radius_max leave nearly no radii; take a constant one";
  return "";
}

std::string table_fault(const SizeDistribution& sizes) {
  if (sizes.sizes.empty() || sizes.sizes.size() != sizes.parts.size())
    return "sizes and parts must be lists of the same length";
  for (std::size_t k = 0; k < sizes.sizes.size(); ++k)
    if (!(sizes.sizes[k] > 0 && sizes.parts[k] >= 0)) return "sizes must be > 0 and parts >= 0";
  if (sizes.kind == Kind::fractions)
    return *std::ranges::min_element(sizes.parts) > 0 ? "" : "every fraction must have a mass > 0";
  if (sizes.sizes.size() < 2) return "a sieve table needs two sieves at least";
  for (std::size_t k = 1; k < sizes.sizes.size(); ++k)
    if (!(sizes.sizes[k] > sizes.sizes[k - 1] && sizes.parts[k] >= sizes.parts[k - 1]))
      return "openings of sieves must ascend, and so must what passes them";
  if (sizes.parts.front() != 0 || sizes.parts.back() != 100)
    return "0 per cent must pass the finest sieve and 100 per cent the coarsest: else there are grains "
           "without "
           "bounds";
  return "";
}

}  // namespace

std::string fault_of(const SizeDistribution& sizes) {
  if (sizes.kind == Kind::sieve || sizes.kind == Kind::fractions) return table_fault(sizes);
  const std::string fault = bounds_fault(sizes);
  const bool bell = sizes.kind == Kind::normal || sizes.kind == Kind::lognormal;
  return fault.empty() && bell ? bell_fault(sizes) : fault;
}

double smallest_radius(const SizeDistribution& sizes) {
  if (sizes.kind == Kind::constant) return sizes.max;
  if (sizes.kind == Kind::sieve) return sizes.sizes.front() / 2;
  return sizes.kind == Kind::fractions ? *std::ranges::min_element(sizes.sizes) : sizes.min;
}

double largest_radius(const SizeDistribution& sizes) {
  if (sizes.kind == Kind::sieve) return sizes.sizes.back() / 2;
  return sizes.kind == Kind::fractions ? *std::ranges::max_element(sizes.sizes) : sizes.max;
}

RadiusSource::RadiusSource(SizeDistribution sizes) : sizes_(std::move(sizes)) {
  if (const std::string fault = fault_of(sizes_); !fault.empty()) throw std::invalid_argument(fault);
  const std::vector<double>& size = sizes_.sizes;
  double sum = 0;
  if (sizes_.kind == Kind::fractions)
    for (std::size_t k = 0; k < size.size(); ++k)
      share_.push_back(sum += sizes_.parts[k] / (size[k] * size[k] * size[k]));
  if (sizes_.kind == Kind::sieve)
    for (std::size_t k = 1; k < size.size(); ++k)
      share_.push_back(sum += (sizes_.parts[k] - sizes_.parts[k - 1]) * number_between(size[k - 1], size[k]));
  for (double& share : share_) share /= sum;
}

/// Radius of a grain of the class that the number in [0, 1) falls into.
double RadiusSource::by_class(double number) const {
  const std::size_t last = share_.size() - 1;
  const auto k =
      std::min(last, static_cast<std::size_t>(std::ranges::upper_bound(share_, number) - share_.begin()));
  if (sizes_.kind == Kind::fractions) return sizes_.sizes[k];
  const double below = k == 0 ? 0 : share_[k - 1];
  const double u = (number - below) / (share_[k] - below);
  const double a = sizes_.sizes[k] / 2, b = sizes_.sizes[k + 1] / 2;
  const double low = 1 / (a * a), high = 1 / (b * b);
  return std::clamp(1 / std::sqrt(low - u * (low - high)), a, b);
}

/// Of a bell curve, by the polar method (Marsaglia and Bray 1964); what falls outside is drawn again.
double RadiusSource::drawn(const GrainNumber& grain) const {
  for (std::uint32_t again = 0;; ++again) {
    const auto [a, b] =
        detail::uniform_pair(grain.seed, grain.k, detail::radius_draw, grain.stream | again << 16);
    const double x = 2 * a - 1, y = 2 * b - 1, square = x * x + y * y;
    if (!(square < 1 && square > 0)) continue;
    const double z = x * std::sqrt(-2 * detail::portable_log(square) / square);
    const double r = sizes_.kind == Kind::normal ? sizes_.mean + z * sizes_.deviation
                                                 : sizes_.mean * detail::portable_exp(z * sizes_.deviation);
    if (r >= sizes_.min && r <= sizes_.max) return r;
  }
}

double RadiusSource::of(const GrainNumber& grain) const {
  if (sizes_.kind == Kind::constant) return sizes_.max;
  if (sizes_.kind == Kind::normal || sizes_.kind == Kind::lognormal) return drawn(grain);
  const double u = detail::uniform_pair(grain.seed, grain.k, detail::radius_draw, grain.stream)[0];
  if (!share_.empty()) return by_class(u);
  // Inverse of the distribution function; for a density ~ r^-3 it is linear in r^-2.
  const double low = 1 / (sizes_.min * sizes_.min), high = 1 / (sizes_.max * sizes_.max);
  const double r = sizes_.kind == Kind::uniform ? sizes_.min + u * (sizes_.max - sizes_.min)
                                                : 1 / std::sqrt(low - u * (low - high));
  return std::clamp(r, sizes_.min, sizes_.max);
}

std::vector<double> draw_radii(const SizeDistribution& sizes, std::size_t n, std::uint64_t seed,
                               std::uint32_t stream) {
  const RadiusSource source(sizes);
  std::vector<double> radii(n);
  for (std::size_t k = 0; k < n; ++k) radii[k] = source.of({seed, stream, k});
  return radii;
}

}  // namespace talus
