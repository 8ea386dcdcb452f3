#pragma once

namespace talus {

/// Turns the static view of its figure into one that is turned by hand: JavaScript that reads the element
/// beside it with the class `grains` (view_section.cpp writes it). Painted on a 2D canvas, grain by grain
/// from the back, so that no graphics hardware is asked for.
extern const char* const view_script;

}  // namespace talus
