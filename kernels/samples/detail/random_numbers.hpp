#pragma once

/// Random numbers of samples as functions of counters (Random123, philox4x32: Salmon et al., SC'11), and
/// elementary functions whose last bit is the same on every machine.

#include <Random123/philox.h>

#include <array>
#include <cmath>
#include <cstdint>

namespace talus::detail {

/// Two uniform numbers in [0, 1) with 53 random bits each, from (seed, index, draw, stream).
inline std::array<double, 2> uniform_pair(std::uint64_t seed, std::uint64_t index, std::uint32_t draw,
                                          std::uint32_t stream = 0) {
  using Generator = r123::Philox4x32;
  const Generator::key_type key = {
      {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)}};
  const Generator::ctr_type counter = {
      {static_cast<std::uint32_t>(index), static_cast<std::uint32_t>(index >> 32), draw, stream}};
  const Generator::ctr_type word = Generator()(counter, key);
  const auto unit = [](std::uint64_t high, std::uint64_t low) {
    return static_cast<double>((high << 32 | low) >> 11) * 0x1p-53;
  };
  return {unit(word[0], word[1]), unit(word[2], word[3])};
}

// Draws of one seed and index: what they are for must not be correlated.
inline constexpr std::uint32_t radius_draw = 0;
inline constexpr std::uint32_t jitter_draw = 1;          // and the next one
inline constexpr std::uint32_t turn_draw = 3;            // and as many more as it takes
inline constexpr std::uint32_t place_draw = 0x40000000;  // of insertions: and two for each attempt

/// Natural logarithm of x > 0: from the series of artanh, to a relative error of about 1e-15.
inline double portable_log(double x) {
  constexpr double ln2 = 0.693147180559945309417, root_half = 0.707106781186547524401;
  int exponent = 0;
  double m = std::frexp(x, &exponent);
  if (m < root_half) {
    m *= 2;
    --exponent;
  }
  const double t = (m - 1) / (m + 1), square = t * t;  // |t| < 0.172
  double sum = 0;
  for (int n = 23; n >= 1; n -= 2) sum = sum * square + 1.0 / n;
  return exponent * ln2 + 2 * t * sum;
}

/// e^x for |x| < 700: its series, after powers of two are taken out, to a relative error of about 1e-15.
inline double portable_exp(double x) {
  constexpr double ln2 = 0.693147180559945309417;
  const double n = std::floor(x / ln2 + 0.5), rest = x - n * ln2;
  double sum = 1;
  for (int k = 18; k >= 1; --k) sum = 1 + sum * rest / k;
  return std::ldexp(sum, static_cast<int>(n));
}

}  // namespace talus::detail
