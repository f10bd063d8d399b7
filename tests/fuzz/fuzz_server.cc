// The server's processes together on one bus.

#include "anchors/anchors_process.h"
#include "fusion/fusion_process.h"
#include "fuzz.h"
#include "global_ba/global_ba_process.h"
#include "inter_map_ba/inter_map_ba_process.h"
#include "map_points/map_points_process.h"
#include "place_recognition/place_recognition_process.h"
#include "posegraph/posegraph_process.h"
#include "server_channels.h"

static int FuzzServer(const uint8_t* data, size_t size) {
  using namespace pangea;
  fuzz::QuickBus bus;
  PlaceRecognitionProcess place_recognition(bus, PlaceRecognitionOptions{});
  InterMapBaProcess inter_map_ba(bus, LoopVerifierOptions{});
  FusionProcess fusion(bus, LoopVerifierOptions{});
  PoseGraphProcess posegraph(bus, PoseGraphOptions{});
  GlobalBaProcess global_ba(bus, GlobalBaOptions{});
  MapPointsProcess map_points(bus);
  AnchorsProcess anchors(bus, AnchorsOptions{});
  int64_t now_us = 1'000'000;
  fuzz::Play({data, size}, fuzz::ServerChannels(), &bus, [&](int64_t wait_us) {
    now_us += wait_us;
    for (Process* process :
         std::initializer_list<Process*>{&place_recognition, &inter_map_ba, &fusion, &posegraph,
                                         &global_ba, &map_points, &anchors}) {
      process->Tick(now_us);
    }
  });
  posegraph.Finish();
  anchors.Finish();
  bus.Drain();
  return 0;
}
static const pangea::fuzz::Target kServer("server", FuzzServer);
