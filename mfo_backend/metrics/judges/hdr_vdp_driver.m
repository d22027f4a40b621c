% SPDX-License-Identifier: Apache-2.0
% Scores pairs of pictures with the user's copy of HDR-VDP-3, for GNU Octave and MATLAB.
%
% MFO_HDRVDP3 names the folder that holds hdrvdp3.m, MFO_HDRVDP3_JOB one with
%   pairs.txt    width, height, number of pairs, pixels per degree
%   pairs.raw    float32, little endian: for each pair the reference, then the test picture, each as
%                rows of red, green, blue; linear Rec.709 in cd/m^2
% Written there: scores.txt, one Q_JOD a line.

warning('off', 'all');
addpath(genpath(getenv('MFO_HDRVDP3')));
if exist('OCTAVE_VERSION', 'builtin')
    pkg load image;
    pkg load statistics;
end
job = getenv('MFO_HDRVDP3_JOB');
setup = load(fullfile(job, 'pairs.txt'));
width = setup(1); height = setup(2); count = setup(3); ppd = setup(4);
source = fopen(fullfile(job, 'pairs.raw'), 'r', 'ieee-le');
scores = fopen(fullfile(job, 'scores.txt'), 'w');
for pair = 1:count
    pictures = cell(1, 2);
    for which = 1:2
        values = fread(source, 3 * width * height, 'float32=>double');
        pictures{which} = permute(reshape(values, [3, width, height]), [3, 2, 1]);
    end
    result = hdrvdp3('quality', pictures{2}, pictures{1}, 'rgb-bt.709', ppd, {'use_gpu', false, 'quiet', true});
    fprintf(scores, '%.9g\n', result.Q_JOD);
end
fclose(scores);
fclose(source);
