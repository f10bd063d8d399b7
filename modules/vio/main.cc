// recording, or IMU_k IMAGE_k CAMERA_k ─► vio ─► POSE_k, KEYFRAME_k, STATUS_vio_k
//              CORRECTION_k, HAVE, RESEND_REQUEST ─►

#include "vio/command_line.h"

int main(int argc, char** argv) { return pangea::vio::RunCommandLine(argc, argv); }
