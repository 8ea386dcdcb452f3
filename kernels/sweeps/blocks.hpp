#pragma once

/// Kernels of chunks of blocks: contacts of bodies with a tensor of inertia, solved one after the other. The
/// local problem has a full 3x3 block,
///
///     W = (1/m_i + 1/m_j) 1 + sum over both bodies of (R^2/I) B B^T,    v = u_i - u_j + B_i w_i - B_j w_j,
///
/// with the levers B of Contacts, and is solved exactly (kernels/law/friction_cone.hpp). A sphere has
/// B = +-[n]x, which makes W the diagonal of kernels/law/contact_law.hpp. About 600 flop a contact.
///
/// `wall` is null between bodies. Impulses have three components; friction may be 0.

#include <span>

#include "kernels/detection/contacts.hpp"
#include "kernels/sweeps/sweep.hpp"
#include "kernels/sweeps/sweep_kernels.hpp"

namespace talus {

/// One pass of nonlinear Gauss-Seidel over a range. A wall moves along its normal only.
void sweep_blocks(Contacts& contacts, ContactRange range, std::span<Velocity> velocity,
                  ChunkFriction friction, WallCopy* wall);

/// V += M^-1 H r, where r is the impulse that bodies feel, the pull of cohesion included.
void accumulate_blocks(const Contacts& contacts, ContactRange range, std::span<Velocity> velocity,
                       WallCopy* wall);

/// The natural map of each contact as in SweepKernels::error_grains; `wall` has the velocity of the chunk's
/// copy, and 1/M.
ErrorSums error_blocks(const Contacts& contacts, ContactRange range, std::span<const Velocity> velocity,
                       ChunkFriction friction, const WallCopy* wall, Multiplicities parts = {});

}  // namespace talus
