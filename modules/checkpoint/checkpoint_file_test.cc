#include "checkpoint/checkpoint_file.h"
#include <gtest/gtest.h>
