#pragma once

#include <vector>

namespace talus {

/// The middle one, or the mean of both; NaN of none.
double median(std::vector<double> values);

}  // namespace talus
