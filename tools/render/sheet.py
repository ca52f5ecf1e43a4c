"""Draws many small pictures of meshes and their lines as one sheet.
In: MANIFEST.json, {"title": str, "columns": [str], "rows": [{"label": str, "tiles": [tile or null]}]}, where a tile is {"mesh",
"lines", "truth": paths; "label": str}. Out: OUT.png. True lines are a wide green band, found lines thin and red on top: green that
shows is missed, red beside the green is false or misplaced, black dots are found corners."""
import argparse
import json
import numpy as np
from PIL import Image, ImageDraw, ImageFont
from render import picture

TILE = (196, 131)            # pixels
GAP, MARGIN, HEAD = 4, 104, 40
COLOURS = 48                 # of the palette: enough for the shading, and a third of the bytes
LINE = 1.3                   # width of found lines in pixels


def main():
    a = argparse.ArgumentParser(description='draw many meshes with their lines as one sheet')
    a.add_argument('manifest'); a.add_argument('out')
    a = a.parse_args()
    with open(a.manifest, encoding='utf-8') as f:
        sheet = json.load(f)
    rows, columns = sheet['rows'], sheet['columns']
    font, small = ImageFont.load_default(13), ImageFont.load_default(11)
    size = (MARGIN + len(columns) * (TILE[0] + GAP), HEAD + len(rows) * (TILE[1] + GAP))
    out = Image.new('RGB', size, 'white')
    pen = ImageDraw.Draw(out)
    pen.text((4, 3), sheet['title'], fill='black', font=font)
    for j, name in enumerate(columns):
        pen.text((MARGIN + j * (TILE[0] + GAP) + TILE[0] // 2, 22), name, fill='black', font=font, anchor='mt')
    for i, row in enumerate(rows):
        y = HEAD + i * (TILE[1] + GAP)
        pen.multiline_text((4, y + TILE[1] // 2), row['label'].replace(' ', '\n'), fill='black', font=font, anchor='lm')
        for j, tile in enumerate(row['tiles']):
            if tile is None:
                continue
            x = MARGIN + j * (TILE[0] + GAP)
            img = picture(tile['mesh'], tile['lines'], tile['truth'], TILE, width=LINE, plain=True)
            out.paste(Image.fromarray(np.asarray(img)), (x, y))
            pen.text((x + 2, y + 1), tile['label'], fill='#404040', font=small)
    # without dithering, which would cost more bytes than the palette saves
    out.quantize(COLOURS, dither=Image.Dither.NONE).save(a.out, optimize=True)


if __name__ == '__main__':
    main()
