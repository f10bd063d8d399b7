// Live sensors: a camera's calibration, inertial samples, images in chunks, through to the
// odometry.

#include "fuzz.h"
#include "sensor_channels.h"
#include "vio/live/live_input.h"

static int FuzzLiveInput(const uint8_t* data, size_t size) {
  using namespace pangea;
  fuzz::QuickBus bus;
  vio::VioProcessOptions options;
  options.agent_id = 1;
  options.map_utime = 1;
  vio::VioProcess process(bus, options, 1'000'000);
  const vio::LiveInput input(process, 1, ImuNoise{});
  int64_t now_us = 1'000'000;
  fuzz::Play({data, size}, fuzz::SensorChannels(), &bus, [&](int64_t wait_us) {
    now_us += wait_us;
    process.Tick(now_us);
  });
  return 0;
}
static const pangea::fuzz::Target kLiveInput("live_input", FuzzLiveInput);
