#include "sextant/eval/cli/command.h"

int main(int argc, char** argv) { return sextant::program(argc, argv); }
