#!/bin/sh
# Installs what the evaluator needs on Debian: Vulkan's loader, Mesa's drivers, among them lavapipe, and libstdc++.
set -eu
export DEBIAN_FRONTEND=noninteractive
apt-get update
apt-get install --yes --no-install-recommends libvulkan1 mesa-vulkan-drivers libstdc++6
rm -rf /var/lib/apt/lists/*
