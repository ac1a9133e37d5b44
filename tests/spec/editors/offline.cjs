// Loaded into the language server before anything else: whatever it needs, it has on this machine.
"use strict";
const { Socket } = require("node:net");

Socket.prototype.connect = function () {
  throw new Error("the language server asked for the network");
};
