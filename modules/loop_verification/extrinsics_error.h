#pragma once

// The covariance that errors of the cameras' extrinsics add to a constraint. Images give the pose
// of one camera relative to the other; T_body_cam of both converts it to the bodies. All
// constraints between the two maps have the same extrinsics errors.

#include "core/keyframe.h"

namespace pangea {

// Returns the covariance of T_m_c (bodies), in m's body frame. With T_mc = T_body_cam T_cam_cam
// T_cam_body and errors (dp, dtheta) of each T_body_cam in its body's frame:
//   p_mc:  dp_m - (p_mc - p_cam_m) x dtheta_m  -  R_mc (dp_c + p_cam_c x dtheta_c)
//   R_mc:  dtheta_m - R_mc dtheta_c
// Two keyframes of one agent have the same camera, with one common error.
Matrix6d ExtrinsicsCovariance(const Keyframe& m, const Keyframe& c, const Rigid3& T_m_c);

}  // namespace pangea
