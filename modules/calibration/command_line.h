#pragma once

namespace pangea::calibration {

int RunCommandLine(int argc, char** argv);

}  // namespace pangea::calibration
