// pangea-place-recognition: KEYFRAME_*, MAP_STATE, HAVE -> PLACE_MATCH, on the server bus.

#include <memory>

#include "bus/process_main.h"
#include "place_recognition/place_recognition_process.h"

int main(int argc, char** argv) {
  pangea::PlaceRecognitionOptions options;
  pangea::ScratchFileOptions scratch;
  pangea::CheckpointPlace checkpoint;
  pangea::YamlOptions yaml;
  options.Visit(yaml);
  return pangea::ProcessMain(
      argc, argv,
      {"pangea-place-recognition",
       "Finds, for each keyframe, the older keyframes of all maps that show the same place.", yaml,
       &scratch, &checkpoint},
      [&](pangea::Bus& bus) {
        return std::make_unique<pangea::PlaceRecognitionProcess>(
            bus, options, std::make_shared<pangea::ScratchFile>(scratch), checkpoint);
      });
}
