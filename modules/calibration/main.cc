// recording without a calibration ─► pangea-calibrate ─► the same with sensor.yaml files

#include "calibration/command_line.h"

int main(int argc, char** argv) { return pangea::calibration::RunCommandLine(argc, argv); }
