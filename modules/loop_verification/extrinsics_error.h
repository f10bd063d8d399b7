#pragma once

// What the errors of both cameras' extrinsics add to a constraint. Images tell where one camera is
// seen from the other; to the bodies lead T_body_cam, of which every constraint of the two maps has
// the same errors.

#include "core/keyframe.h"

namespace pangea {

// Of T_m_c (bodies), in m's body frame. With T_mc = T_body_cam T_cam_cam T_cam_body and errors (dp,
// dtheta) of each T_body_cam in its body's frame:
//   p_mc:  dp_m - (p_mc - p_cam_m) x dtheta_m  -  R_mc (dp_c + p_cam_c x dtheta_c)
//   R_mc:  dtheta_m - R_mc dtheta_c
// Two keyframes of one agent have one camera, and its error.
Matrix6d ExtrinsicsCovariance(const Keyframe& m, const Keyframe& c, const Rigid3& T_m_c);

}  // namespace pangea
