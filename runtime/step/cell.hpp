#pragma once

/// What a periodic cell asks of the rest of a setup.

#include "kernels/detection/domain.hpp"
#include "runtime/step/setup.hpp"

namespace talus {

/// Throws std::invalid_argument, naming it, for whatever a cell has no room for: walls across an axis that
/// repeats, walls that are no planes or that turn, grains that come or go, and what fault_in_cell finds.
void validate_cell(const Setup& setup);

/// What is wrong with a part of space that is looked at, in the cell with all images; "" if nothing, and
/// between walls.
std::string fault_in_cell(const Setup& setup, const Region& region);
/// ... or with a grid, to which all images within the reach of its function belong.
std::string fault_in_cell(const Setup& setup, const FieldRule& field);

/// Something stands at both ends of an axis: walls, or the images of the cell.
bool bounded(const Setup& setup, Eigen::Index axis);

/// Some stage has a cell that follows a stress.
bool any_stress(const Setup& setup);
/// Throws std::invalid_argument where one does and subdomains are not coupled by NSCDD.
void validate_coupling(const Setup& setup);
/// ... or positions are corrected: the correction does not move the cell, so that it would press grains
/// together elsewhere.
void validate_correction(const Setup& setup);

/// Distance of two grains at rest within which they are candidates [m], where the smallest has this radius.
double candidate_margin(const DetectionSettings& detection, double smallest);

/// Throws std::invalid_argument where a body of the largest radius [m] could touch two images of another, or
/// its own: where an edge is shorter than twice the largest diameter and `margin` [m], the distance at which
/// candidates are looked for.
void check_cell(const Domain& domain, double largest, double margin);

}  // namespace talus
